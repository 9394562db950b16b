"""The measurement store: measurements and the calibrations fitted to them, in one append-only SQLite file.

Each addition is one durable transaction: an interruption leaves the store unchanged, and concurrent writers wait for
each other. `docs/calibration.md` describes the tables.
"""

from __future__ import annotations

import datetime
import hashlib
import json
import math
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sosmith.gen.calibration.fit import Measurements
from sosmith.instrument.calibration.acceptance import METHODS, Method, Range
from sosmith.instrument.calibration.sensor_type import DEFAULT_TYPE, SENSOR_TYPES, SensorType
from sosmith.instrument.calibration.store.measurement_files import MeasurementFile, Reading
from sosmith.instrument.calibration.store.schema import APPLICATION_ID, SCHEMA, SCHEMA_VERSION, bring_up_to_date
from sosmith.model.errors import SpecificationError, ToolError
from sosmith.model.polynomial import Polynomial
from sosmith.model.tables.csv_table import shortened

PATIENCE = 60.0
"""Time in s that a writer waits for another one."""

LARGEST = 1 << 28
"""Most bytes of a store: one of 10,000 measurements has some three million."""

_COMPLAINTS = {
    "database is locked": "must be free within a minute, not locked by another program",
    "file is not a database": "must be a store of measurements, not another kind of file",
}


_UNREACHABLE = {
    sqlite3.SQLITE_PERM,
    sqlite3.SQLITE_BUSY,
    sqlite3.SQLITE_LOCKED,
    sqlite3.SQLITE_NOMEM,
    sqlite3.SQLITE_READONLY,
    sqlite3.SQLITE_INTERRUPT,
    sqlite3.SQLITE_IOERR,
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_CANTOPEN,
    sqlite3.SQLITE_PROTOCOL,
}
"""Primary codes of errors that are not about what the file holds."""

_OPTIONAL = (float, type(None))
_WHOLE = (int, type(None))
_MEASUREMENT = (int, str, int, str, float, float, float, str, *[_OPTIONAL] * 3)
_TEXT = (str, type(None))
_VERSION = (int, str, int, int, str, float, int, str, float, float, _OPTIONAL, _OPTIONAL, str, _TEXT, _OPTIONAL, int)
_SOURCE = (int, str, str, int, str, str, _WHOLE, _TEXT, _TEXT, _TEXT)
"""Types of the values of a row; SQLite checks them only when it writes."""


@dataclass(frozen=True)
class StoredMeasurement:
    """A measurement in the store: its number, the name of its file, and its row there."""

    number: int
    source: str
    reading: Reading


@dataclass(frozen=True)
class Withdrawal:
    """That a file does not count: number of the withdrawal, its date, who withdrew it, and why."""

    number: int
    date: str
    author: str
    reason: str


@dataclass(frozen=True)
class Source:
    """A file that was added.

    Attributes
    ----------
    number : int
        Its number in the store.
    name, sha256 : str
        Its path as given, and its hash.
    measurements : int
        Number of measurements that were stored from it, withdrawn or not.
    first, last : str
        Dates of the first and the last of them.
    withdrawal : Withdrawal or None
        That it does not count, if so.
    """

    number: int
    name: str
    sha256: str
    measurements: int
    first: str
    last: str
    withdrawal: Withdrawal | None


@dataclass(frozen=True)
class Version:
    """One version of a sensor's calibration.

    Attributes
    ----------
    number : int
        Number of the version, from 1 for each sensor.
    date : str
        Date of the fit, such as 2024-03-01.
    measurements, last_measurement : int
        Number of measurements it was fitted to, and the number of the last one: all of the sensor up to that one, but
        for those of withdrawn files.
    data_sha256 : str
        SHA-256 over the hashes of these measurements.
    required_r : float
        Adjusted r that was required; 0 for a Bayesian calibration.
    robust : bool
        Whether outliers were weighted down.
    polynomial : Polynomial
        Clearance in mm from voltage in V and temperature in degC; coefficients are doubles.
    adjusted_r_squared, rms, cross_validated : float
        As in `Fit` and `FitQuality`; `rms` and `cross_validated` in mm. The latter is None if it is undefined.
    drift : float or None
        Largest difference in mm from the previous version, over the region that the measurements cover; None for
        the first version.
    method : str
        One of `acceptance.METHODS`.
    sensor_type : SensorType or None
        The prior of a Bayesian calibration; None for the paper's method.
    accept : float or None
        Largest half-width of an interval in mm that was acceptable; None if not limited.
    last_withdrawal : int
        Number of the last withdrawal of one of the sensor's files before it; 0 if there was none.
    """

    number: int
    date: str
    measurements: int
    last_measurement: int
    data_sha256: str
    required_r: float
    robust: bool
    polynomial: Polynomial
    adjusted_r_squared: float
    rms: float
    cross_validated: float | None
    drift: float | None
    method: Method = "paper"
    sensor_type: SensorType | None = None
    accept: float | None = None
    last_withdrawal: int = 0


class MeasurementStore:
    """An open measurement store; see `open_store`."""

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self._sql = connection

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Run the block as one transaction; other writers wait."""
        self._sql.execute("BEGIN IMMEDIATE")
        try:
            yield
        except BaseException:
            if self._sql.in_transaction:  # on a full disk SQLite has rolled it back already
                self._sql.execute("ROLLBACK")
            raise
        self._sql.execute("COMMIT")

    def sensors(self) -> list[str]:
        """Return the names of all sensors, sorted."""
        return [name for (name,) in self._rows((str,), "SELECT name FROM sensor ORDER BY name")]

    def ranges(self, sensor: str) -> tuple[Range, Range, Range] | None:
        """Return the ranges of clearance in mm, voltage in V and temperature in degC; None for an unknown sensor."""
        rows = self._rows(
            (float,) * 6,
            "SELECT clearance_low_mm, clearance_high_mm, voltage_low_V, voltage_high_V, temperature_low_C, "
            "temperature_high_C FROM sensor WHERE name = ?",
            sensor,
        )
        row = next(iter(rows), None)
        return None if row is None else ((row[0], row[1]), (row[2], row[3]), (row[4], row[5]))

    def set_ranges(self, sensor: str, ranges: tuple[Range, Range, Range]) -> None:
        """Insert a sensor, or change its ranges."""
        self._sql.execute(
            "INSERT INTO sensor VALUES (NULL, ?, ?, ?, ?, ?, ?, ?, NULL) ON CONFLICT (name) DO UPDATE SET "
            "(clearance_low_mm, clearance_high_mm, voltage_low_V, voltage_high_V, temperature_low_C, "
            "temperature_high_C) = (excluded.clearance_low_mm, excluded.clearance_high_mm, excluded.voltage_low_V, "
            "excluded.voltage_high_V, excluded.temperature_low_C, excluded.temperature_high_C)",
            (sensor, *(limit for pair in ranges for limit in pair)),
        )

    def sensor_type(self, sensor: str) -> SensorType:
        """Return the type of a sensor; equation 5a if none was given.

        Raises
        ------
        SpecificationError
            If the store is damaged.
        """
        rows = self._rows((_TEXT,), "SELECT type FROM sensor WHERE name = ?", sensor)
        text = next((text for (text,) in rows), None)
        return SENSOR_TYPES[DEFAULT_TYPE] if text is None else self._type(text)

    def set_sensor_type(self, sensor: str, sensor_type: SensorType) -> None:
        """Change the type of a sensor that is in the store."""
        self._sql.execute("UPDATE sensor SET type = ? WHERE name = ?", (sensor_type.json(), sensor))

    def sources(self, sensor: str) -> list[Source]:
        """Return the files of a sensor in the order in which they were added, withdrawn ones too."""
        rows = self._rows(
            _SOURCE,
            "SELECT source.id, source.name, source.sha256, count(*), min(measurement.date), max(measurement.date), "
            "withdrawal.id, withdrawal.date, author, reason FROM source "
            "JOIN sensor ON sensor.id = source.sensor JOIN measurement ON measurement.source = source.id "
            "LEFT JOIN withdrawal ON withdrawal.source = source.id "
            "WHERE sensor.name = ? GROUP BY source.id ORDER BY source.id",
            sensor,
        )
        found = []
        for number, name, sha256, count, first, last, *gone in rows:
            withdrawal = None if gone[0] is None else Withdrawal(*gone)
            found.append(Source(number, name, sha256, count, first, last, withdrawal))
        return found

    def withdraw(self, source: int, date: str, author: str, reason: str) -> None:
        """Record that a file, by its number, does not count from now on."""
        self._sql.execute("INSERT INTO withdrawal VALUES (NULL, ?, ?, ?, ?)", (source, date, author, reason))

    def last_withdrawal(self, sensor: str) -> int:
        """Return the number of the last withdrawal of a file of a sensor; 0 if there is none."""
        return max((one.withdrawal.number for one in self.sources(sensor) if one.withdrawal is not None), default=0)

    def insert(self, sensor: str, file: MeasurementFile) -> None:
        """Insert the valid rows of a file, none of which may be in the store already."""
        (sensor_id,) = self._sql.execute("SELECT id FROM sensor WHERE name = ?", (sensor,)).fetchone()
        name = str(file.path).encode(errors="backslashreplace").decode()  # a file's name may be no UTF-8
        source = self._sql.execute(
            "INSERT INTO source VALUES (NULL, ?, ?, ?)", (sensor_id, name, file.sha256)
        ).lastrowid
        self._sql.executemany(
            "INSERT INTO measurement VALUES (NULL, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            [
                (
                    *(sensor_id, source, reading.line, reading.date),
                    *(*reading.values, reading.sha256(sensor)),
                    *(one or None for one in reading.uncertainty),
                )
                for reading in file.readings
            ],
        )

    def measurements(
        self, sensor: str, last: int | None = None, last_withdrawal: int | None = None
    ) -> list[StoredMeasurement]:
        """Return the measurements of a sensor in the order in which they were added, up to number `last`.

        Those of files that were withdrawn up to the withdrawal of number `last_withdrawal`, by default of all withdrawn
        files, are left out.

        Raises
        ------
        SpecificationError
            If a measurement differs from its stored hash, or the store is damaged.
        """
        found = []
        for number, source, line, date, d, V, T, sha256, *stated in self._rows(
            _MEASUREMENT,
            "SELECT measurement.id, source.name, line, measurement.date, clearance_mm, voltage_V, temperature_C, "
            "measurement.sha256, uncertainty_mm, uncertainty_V, uncertainty_C FROM measurement "
            "JOIN sensor ON sensor.id = measurement.sensor "
            "JOIN source ON source.id = measurement.source "
            "LEFT JOIN withdrawal ON withdrawal.source = source.id AND withdrawal.id <= coalesce(?, withdrawal.id) "
            "WHERE sensor.name = ? AND measurement.id <= coalesce(?, measurement.id) AND withdrawal.id IS NULL "
            "ORDER BY measurement.id",
            last_withdrawal,
            sensor,
            last,
        ):
            reading = Reading(line, date, (d, V, T), (stated[0] or 0.0, stated[1] or 0.0, stated[2] or 0.0))
            if reading.sha256(sensor) != sha256:
                raise SpecificationError(
                    f"{self.path}: measurement {number} must match its stored hash, not differ from it"
                )
            found.append(StoredMeasurement(number, source, reading))
        return found

    def versions(self, sensor: str) -> list[Version]:
        """Return the versions of a sensor's calibration, oldest first.

        Raises
        ------
        SpecificationError
            If the store is damaged.
        """
        rows = self._rows(
            _VERSION,
            "SELECT number, date, measurements, last_measurement, data_sha256, required_r, robust, coefficients, "
            "adjusted_r_squared, rms_mm, cross_validated_mm, drift_mm, method, type, accept_mm, last_withdrawal "
            "FROM version "
            "WHERE sensor = (SELECT id FROM sensor WHERE name = ?) ORDER BY number",
            sensor,
        )
        return [
            Version(
                number,
                self._date(date),
                count,
                last,
                data,
                required_r,
                bool(robust),
                self._polynomial(text),
                r,
                rms,
                left_out,
                drift,
                self._method(method),
                None if sensor_type is None else self._type(sensor_type),
                accept,
                last_withdrawal,
            )
            for (
                number,
                date,
                count,
                last,
                data,
                required_r,
                robust,
                text,
                r,
                rms,
                left_out,
                drift,
                method,
                sensor_type,
                accept,
                last_withdrawal,
            ) in rows
        ]

    def insert_version(self, sensor: str, version: Version) -> None:
        """Insert a version; its number must be the next one."""
        coefficients = [[float(a).hex() for a in row] for row in version.polynomial.coefficients]
        self._sql.execute(
            "INSERT INTO version SELECT id, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ? FROM sensor WHERE name = ?",
            (
                version.number,
                version.date,
                version.measurements,
                version.last_measurement,
                version.data_sha256,
                version.required_r,
                int(version.robust),
                json.dumps(coefficients),
                version.adjusted_r_squared,
                version.rms,
                version.cross_validated,
                version.drift,
                version.method,
                None if version.sensor_type is None else version.sensor_type.json(),
                version.accept,
                version.last_withdrawal,
                sensor,
            ),
        )

    def check(self) -> None:
        """Run SQLite's integrity check on the whole file.

        Raises
        ------
        SpecificationError
            If it reports an error.
        """
        complaints = [text for (text,) in self._sql.execute("PRAGMA integrity_check")]
        if complaints != ["ok"]:
            first = " ".join(complaints[0].splitlines()[:2])
            raise SpecificationError(f"{self.path} must be an undamaged store, not: {first}")

    def _rows(self, types: Sequence[Any], query: str, *values: str | int | None) -> list[tuple[Any, ...]]:
        """Return the rows that a query finds, each with finite values of these types."""
        rows: list[tuple[Any, ...]] = self._sql.execute(query, values).fetchall()
        for row in rows:
            for value, kind in zip(row, types, strict=True):
                if not isinstance(value, kind) or (isinstance(value, float) and not math.isfinite(value)):
                    raise self._damaged(value)
        return rows

    def _polynomial(self, coefficients: str) -> Polynomial:
        try:
            return Polynomial.from_numbers([[float.fromhex(a) for a in row] for row in json.loads(coefficients)])
        except (ValueError, TypeError, ArithmeticError, RecursionError):
            raise self._damaged(coefficients) from None

    def _date(self, text: str) -> str:
        try:
            datetime.date.fromisoformat(text)
        except ValueError:
            raise self._damaged(text) from None
        return text

    def _type(self, text: str) -> SensorType:
        try:
            return SensorType.from_json(text)
        except (ValueError, TypeError, KeyError, SpecificationError, RecursionError):
            raise self._damaged(text) from None

    def _method(self, text: str) -> Method:
        for method in METHODS:
            if text == method:
                return method
        raise self._damaged(text)

    def _damaged(self, value: Any) -> SpecificationError:
        return SpecificationError(
            f"{self.path} must be an undamaged store, not one with the value {shortened(str(value))}"
        )


@contextmanager
def open_store(path: Path, *, create: bool = False) -> Iterator[MeasurementStore]:
    """Open a store; with `create`, make it if it does not exist.

    A store that is made and then left by an error without a measurement in it is removed again.

    Raises
    ------
    SpecificationError
        If there is no store, or the file is not one, is damaged, or has another schema version.
    ToolError
        If the file cannot be read or written, or another program keeps it locked; also while it is open.
    """
    if not create and not path.is_file():
        raise SpecificationError(f"{path} must be an existing store of measurements; sosmith calibrate add creates one")
    is_new = create and not path.exists()
    if not is_new and path.stat().st_size > LARGEST:
        raise SpecificationError(f"{path}: the store must be at most {LARGEST} bytes, not {path.stat().st_size}")
    try:
        with closing(sqlite3.connect(path, timeout=PATIENCE, isolation_level=None)) as connection:
            try:
                # EXTRA: a committed transaction survives a power failure.
                connection.execute("PRAGMA synchronous = EXTRA")
                connection.execute("PRAGMA foreign_keys = ON")
                store = MeasurementStore(path, connection)
                _prepare(store, connection)
                yield store
            except BaseException:
                if is_new:
                    _remove_if_empty(path, connection)
                raise
    except (sqlite3.Error, UnicodeDecodeError) as error:  # the latter if a damaged name is in SQLite's own message
        # The low byte is the primary code. Errors that Python raises by itself have none and are about the content.
        if getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) & 0xFF in _UNREACHABLE:
            complaint = _COMPLAINTS.get(str(error), f"must be readable and writable, not: {error}")
            raise ToolError(f"{path}: the store {complaint}") from None
        complaint = _COMPLAINTS.get(str(error), f"must be undamaged, not: {error}")
        raise SpecificationError(f"{path}: the file {complaint}") from None


def _prepare(store: MeasurementStore, connection: sqlite3.Connection) -> None:
    """Create the tables in an empty file; reject a file that is not a store."""
    if _pragmas(connection) == (0, 0):
        with store.transaction():  # unless another process was faster
            (tables,) = connection.execute("SELECT count(*) FROM sqlite_schema").fetchone()
            if tables == 0:
                for statement in SCHEMA:
                    connection.execute(statement)
                connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
                connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")
    application, version = _pragmas(connection)
    if application != APPLICATION_ID:
        raise SpecificationError(f"{store.path} must be a store of measurements, not another SQLite database")
    if 0 < version < SCHEMA_VERSION:
        # SQLite would take a table that is dropped for one whose rows are deleted, and ignores this in a transaction.
        connection.execute("PRAGMA foreign_keys = OFF")
        with store.transaction():
            bring_up_to_date(connection)
        connection.execute("PRAGMA foreign_keys = ON")
        version = SCHEMA_VERSION
    if version != SCHEMA_VERSION:
        raise SpecificationError(f"{store.path}: the store's schema must be version {SCHEMA_VERSION}, not {version}")


def _remove_if_empty(path: Path, connection: sqlite3.Connection) -> None:
    """Remove a store without sensors, unless another program works on it.

    A program that waits for it meanwhile cannot write into the removed file: SQLite refuses to.
    """
    with suppress(sqlite3.Error, OSError):
        connection.execute("PRAGMA busy_timeout = 0")
        connection.execute("BEGIN EXCLUSIVE")
        tables = {name for (name,) in connection.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")}
        if not tables or ("sensor" in tables and not MeasurementStore(path, connection).sensors()):
            path.resolve().unlink()


def _pragmas(connection: sqlite3.Connection) -> tuple[int, int]:
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    return application, version


def as_measurements(stored: Sequence[StoredMeasurement], source: str) -> Measurements:
    """Return stored measurements as arrays for `fit`; `source` names them in messages."""
    values = np.array([one.reading.values for one in stored], dtype=np.float64).reshape(-1, 3)
    clearance, voltage, temperature = values.T
    days = tuple(datetime.date.fromisoformat(one.reading.date).toordinal() for one in stored)
    stated = np.array([one.reading.uncertainty for one in stored], dtype=np.float64).reshape(-1, 3).T.copy()
    columns = (clearance.copy(), voltage.copy(), temperature.copy())
    return Measurements(*columns, source, days, stated if stated.any() else None)


def data_sha256(stored: Sequence[StoredMeasurement], sensor: str) -> str:
    """Return the SHA-256 over the hashes of measurements, in their order."""
    return hashlib.sha256("\n".join(one.reading.sha256(sensor) for one in stored).encode()).hexdigest()
