"""The self-updating calibration: files go in, and every addition makes a new version of the polynomial."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sosmith.model.calibration.acceptance import DEFAULT_RANGES, REQUIRED_R, Range
from sosmith.model.calibration.covered_region import CoveredRegion
from sosmith.model.calibration.fit import Fit, Measurements, Progress, fit, root_mean_square, untold
from sosmith.model.calibration.fit_quality import FitQuality, assess
from sosmith.model.calibration.measurement_files import (
    MeasurementFile,
    Refusal,
    read_measurement_file,
)
from sosmith.model.calibration.measurement_store import (
    MeasurementStore,
    StoredMeasurement,
    Version,
    as_measurements,
    data_sha256,
)
from sosmith.model.errors import ShortfallError, SpecificationError

SWAPPED_FITS, SWAPPED_OFF = 2.0, 4.0
"""A file is taken for swapped if its rms residual, over the version's, is less than the first with clearance and
voltage exchanged and more than the second as it is. A sensor that has changed fits neither way."""

SWAPPED_ROWS = 4
"""Rows that it takes to tell."""


@dataclass(frozen=True)
class Calibration:
    """A version with everything that its report needs.

    Attributes
    ----------
    sensor : str
        Name of the sensor.
    version : Version
        The version.
    new : bool
        Whether it was just made; False if nothing had changed since.
    stored : list of StoredMeasurement
        What it was fitted to.
    fit : Fit
        The fit.
    quality : FitQuality
        Its figures.
    ranges : tuple of Range
        Ranges of the sensor: clearance in mm, voltage in V, temperature in degC.
    drift : dict
        Largest difference in mm to each earlier version, by its number, over the region covered now.
    """

    sensor: str
    version: Version
    new: bool
    stored: Sequence[StoredMeasurement]
    fit: Fit
    quality: FitQuality
    ranges: tuple[Range, Range, Range]
    drift: dict[int, float]

    @property
    def coverage(self) -> float:
        """Share of the sensor's range of voltage and temperature that lies between measurements."""
        _, (v_low, v_high), (t_low, t_high) = self.ranges
        return self.quality.region.area / ((v_high - v_low) * (t_high - t_low))


@dataclass(frozen=True)
class Addition:
    """What became of a file.

    Attributes
    ----------
    file : MeasurementFile
        Its rows, those that are already in the store among the refusals.
    kept : bool
        Whether the good rows went into the store.
    calibration : Calibration or None
        The version that came of it; None if nothing was kept or no polynomial is good enough.
    shortfall : str
        Why there is no version although rows were kept; empty otherwise.
    """

    file: MeasurementFile
    kept: bool
    calibration: Calibration | None
    shortfall: str


def add(
    store: MeasurementStore,
    sensor: str,
    path: Path,
    date: str,
    *,
    ranges: tuple[Range | None, Range | None, Range | None] = (None, None, None),
    keep_good: bool = False,
    required_r: float = REQUIRED_R,
    robust: bool = False,
    progress: Progress = untold,
) -> Addition:
    """Read a file into the store and fit anew, in one transaction.

    Parameters
    ----------
    store : MeasurementStore
        Where to.
    sensor : str
        Name of the sensor; entered if it is new.
    path : Path
        CSV or XLSX file.
    date : str
        Day of measurements without a date of their own, and of the version.
    ranges : tuple of Range or None
        Ranges of clearance in mm, voltage in V and temperature in degC, from now on; None leaves one as it was.
    keep_good : bool
        Whether to keep the good rows of a file that has others.
    required_r, robust, progress
        As in `fit`.

    Raises
    ------
    SpecificationError
        As `read_measurement_file`; if the file was added before. Nothing is written then.
    """
    _check_sensor(sensor)
    with store.transaction():
        before = store.ranges(sensor)
        usual = before or DEFAULT_RANGES
        now = _ranges_from_now_on(ranges, usual)
        file = read_measurement_file(path, date, now)
        earlier = store.source_of(sensor, file.sha256)
        if earlier is not None:
            raise SpecificationError(f"{path} must be a file of new measurements, not what was added as {earlier}")
        file = _sift(store, sensor, file)
        if not _keeps(file, keep_good=keep_good):
            return Addition(file, False, None, "")
        if now != before:
            store.set_ranges(sensor, now)
        store.insert(sensor, file)
        try:
            return Addition(file, True, _fit(store, sensor, date, required_r, progress, robust=robust), "")
        except SpecificationError as error:
            return Addition(file, True, None, str(error))


def refused_first_file(
    sensor: str,
    path: Path,
    date: str,
    *,
    ranges: tuple[Range | None, Range | None, Range | None] = (None, None, None),
    keep_good: bool = False,
) -> Addition | None:
    """Read what would be the first file of a store; return what became of it if nothing of it is kept, else None.

    To be asked before `open_store` makes a store that is not there yet: a file that is refused then leaves none.

    Raises
    ------
    SpecificationError
        As `read_measurement_file`.
    """
    _check_sensor(sensor)
    file = read_measurement_file(path, date, _ranges_from_now_on(ranges, DEFAULT_RANGES))
    return None if _keeps(file, keep_good=keep_good) else Addition(file, False, None, "")


def refit(
    store: MeasurementStore,
    sensor: str,
    date: str,
    *,
    required_r: float = REQUIRED_R,
    robust: bool = False,
    progress: Progress = untold,
) -> Calibration:
    """Fit to all measurements of a sensor; a new version is made only if anything has changed.

    Raises
    ------
    SpecificationError
        If the sensor has no measurements.
    ShortfallError
        If no polynomial is good enough.
    """
    with store.transaction():
        _known(store, sensor)
        try:
            return _fit(store, sensor, date, required_r, progress, robust=robust)
        except SpecificationError as error:
            raise ShortfallError(str(error)) from None


def find_version(store: MeasurementStore, sensor: str, number: int | None = None) -> Version:
    """Look a version up, the newest if no number is given.

    Raises
    ------
    SpecificationError
        If there is no such sensor or version.
    """
    _known(store, sensor)
    versions = store.versions(sensor)
    if not versions:
        raise SpecificationError(f"{store.path}: sensor {sensor} must have a fitted version, not only measurements")
    if number is None:
        return versions[-1]
    if not 1 <= number <= len(versions):
        raise SpecificationError(f"the version of sensor {sensor} must be 1 to {len(versions)}, not {number}")
    return versions[number - 1]


def calibration_of(store: MeasurementStore, sensor: str, number: int | None = None) -> Calibration:
    """Fit a version again from the store, the newest if no number is given.

    Raises
    ------
    SpecificationError
        As `find_version`.
    ShortfallError
        If it does not come out the same, to the last bit.
    """
    version = find_version(store, sensor, number)
    stored = store.measurements(sensor, version.last_measurement)
    try:
        again = _calibration(store, sensor, stored, version.date, version.required_r, version.robust, version.number)
    except SpecificationError as error:
        raise ShortfallError(
            f"version {version.number} of sensor {sensor} must come out the same, not: {error}"
        ) from None
    if again.version != version:
        raise ShortfallError(
            f"version {version.number} of sensor {sensor} must come out the same, not another polynomial"
        )
    return again


def _known(store: MeasurementStore, sensor: str) -> None:
    sensors = store.sensors()
    if not sensors:
        raise SpecificationError(f"{store.path} must hold measurements; sosmith calibrate add takes them in")
    if sensor not in sensors:
        raise SpecificationError(f"{store.path}: the sensor must be one of {', '.join(sensors)}, not {sensor}")


def _check_sensor(sensor: str) -> None:
    if not sensor.strip() or not sensor.isprintable():
        raise SpecificationError(f"the sensor's name must be printable text, not {sensor!r}")


def _ranges_from_now_on(
    given: tuple[Range | None, Range | None, Range | None], usual: tuple[Range, Range, Range]
) -> tuple[Range, Range, Range]:
    first, second, third = (one or old for one, old in zip(given, usual, strict=True))
    return first, second, third


def _keeps(file: MeasurementFile, *, keep_good: bool) -> bool:
    """Whether the good rows of a file are to go into the store."""
    return bool(file.readings) and (keep_good or not file.refusals)


def _sift(store: MeasurementStore, sensor: str, file: MeasurementFile) -> MeasurementFile:
    """Move what is in the store already to the refusals, and everything if two columns are exchanged."""
    known = {one.reading.values: one for one in store.measurements(sensor)}
    versions = store.versions(sensor)
    swapped = _swapped(file, versions[-1]) if versions else ""
    refusals = list(file.refusals)
    readings = []
    for reading in file.readings:
        if reading.values in known:
            one = known[reading.values]
            where = f"measurement {one.number} ({one.source}, line {one.reading.line}, {one.reading.date})"
            refusals.append(Refusal(reading.line, f"row must be a measurement of its own, not a duplicate of {where}"))
        elif swapped:
            refusals.append(Refusal(reading.line, swapped))
        else:
            readings.append(reading)
    refusals.sort(key=lambda refusal: refusal.line)
    return replace(file, readings=tuple(readings), refusals=tuple(refusals))


def _swapped(file: MeasurementFile, version: Version) -> str:
    """Sentence about a file that fits the version well only with clearance and voltage exchanged, or nothing."""
    if len(file.readings) < SWAPPED_ROWS:
        return ""
    clearance, voltage, temperature = np.array([reading.values for reading in file.readings]).T
    as_it_is = root_mean_square(clearance - version.polynomial(voltage, temperature))
    exchanged = root_mean_square(voltage - version.polynomial(clearance, temperature))
    if exchanged >= SWAPPED_FITS * version.rms or as_it_is <= SWAPPED_OFF * version.rms:
        return ""
    return (
        "clearance_mm and voltage_V must be in their own columns, not swapped: the file is "
        f"{as_it_is:.3g} mm rms off version {version.number}, and swapped {exchanged:.3g} mm"
    )


def _fit(
    store: MeasurementStore, sensor: str, date: str, required_r: float, progress: Progress, *, robust: bool
) -> Calibration:
    versions = store.versions(sensor)
    stored = store.measurements(sensor)
    made = _calibration(store, sensor, stored, date, required_r, robust, len(versions) + 1, progress)
    if versions:
        newest = versions[-1]
        if replace(made.version, number=newest.number, date=newest.date, drift=newest.drift) == newest:
            return replace(made, version=newest, new=False, drift={k: made.drift[k] for k in range(1, newest.number)})
    store.insert_version(sensor, made.version)
    return replace(made, new=True)


def _calibration(
    store: MeasurementStore,
    sensor: str,
    stored: Sequence[StoredMeasurement],
    date: str,
    required_r: float,
    robust: bool,
    number: int,
    progress: Progress = untold,
) -> Calibration:
    """Fit and compare with the versions before `number`."""
    measurements: Measurements = as_measurements(stored, f"{store.path}, sensor {sensor}")
    fitted = fit(measurements, required_r, robust=robust, progress=progress)
    quality = assess(measurements, fitted)
    region: CoveredRegion = quality.region
    drift = {
        version.number: region.largest_difference(fitted.polynomial, version.polynomial)
        for version in store.versions(sensor)[: number - 1]
    }
    version = Version(
        number=number,
        date=date,
        measurements=len(stored),
        last_measurement=stored[-1].number,
        data_sha256=data_sha256(stored, sensor),
        required_r=required_r,
        robust=robust,
        polynomial=fitted.polynomial,
        adjusted_r_squared=fitted.adjusted_r_squared,
        rms=fitted.rms,
        cross_validated=quality.cross_validated,
        drift=drift.get(number - 1),
    )
    ranges = store.ranges(sensor)
    assert ranges is not None, "measurements belong to a sensor"
    return Calibration(sensor, version, False, stored, fitted, quality, ranges, drift)
