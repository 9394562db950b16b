"""A store of measurements: each addition fits the calibration of a sensor again."""

from __future__ import annotations

import datetime
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from sosmith.gen.calibration.acceptance import REQUIRED_R
from sosmith.gen.facts.table import Table, View
from sosmith.gen.quantity import count
from sosmith.instrument.calibration.acceptance import Method, Range
from sosmith.instrument.calibration.advice import Advice
from sosmith.instrument.calibration.calibration_report import (
    addition_json,
    advice_json,
    calibration_json,
    design_table,
    measurements_csv,
    morning_json,
    source_json,
    specification_table,
    version_json,
)
from sosmith.instrument.calibration.calibration_tables import (
    addition_table,
    advice_tables,
    calibration_tables,
    health_table,
    history_table,
    morning_tables,
    sources_table,
)
from sosmith.instrument.calibration.health.health_report import health_json
from sosmith.instrument.calibration.health.monitoring import Health
from sosmith.instrument.calibration.measurement_store import MeasurementStore, Source, Version, open_store
from sosmith.instrument.calibration.self_updating import (
    Addition,
    Calibration,
    add,
    advice_for,
    calibration_of,
    find_version,
    health_for,
    refit,
    refused_first_file,
)
from sosmith.instrument.calibration.sensor_type_file import sensor_type_named
from sosmith.instrument.calibration.store.measurement_files import Refusal, parse_date
from sosmith.instrument.calibration.store.reference import Morning, by_hand, reference
from sosmith.instrument.calibration.store.withdrawing import Withdrawn, sources_of, withdraw
from sosmith.interface.certificate import Progress
from sosmith.model.errors import ShortfallError, SpecificationError


@dataclass(frozen=True, kw_only=True)
class FitOptions:
    """How measurements are fitted.

    Attributes
    ----------
    method : str
        "bayes" or "paper".
    sensor_type : str or None
        With "bayes": name of a type, or a TOML file; None for the one that the sensor has.
    required_r : float or None
        With "paper": adjusted r to reach, from 0 to below 1; None for `REQUIRED_R`.
    robust : bool
        With "paper": give outliers less weight (Huber).
    accept : float or None
        Largest half-width in mm of the 95 % interval of a reading's clearance; None if not limited.
    order : int or None
        With "bayes": highest order in the voltage of a day's polynomial from now on, 2 to 8; None for that of the type.
        The hardware must have room for it.
    """

    method: Method = "bayes"
    sensor_type: str | None = None
    required_r: float | None = None
    robust: bool = False
    accept: float | None = None
    order: int | None = None

    def settings(self, store: MeasurementStore, sensor: str) -> dict[str, Any]:
        """Return them checked, for a sensor of a store; raises SpecificationError if they do not go together."""
        self.check()
        kind = None if self.sensor_type is None else sensor_type_named(self.sensor_type)
        if self.order is not None:
            kind = replace(kind or store.sensor_type(sensor), order=self.order)
        return {
            "method": self.method,
            "sensor_type": kind,
            "required_r": REQUIRED_R if self.required_r is None else self.required_r,
            "robust": self.robust,
            "accept": self.accept,
        }

    def check(self) -> None:
        """Raise SpecificationError if they do not go together, or a type is none."""
        if self.method == "paper" and self.order is not None:
            raise SpecificationError("--order must go with --method bayes, not with --method paper")
        if self.sensor_type is not None:
            sensor_type_named(self.sensor_type)
        if self.method != "paper":
            for name, given in (("--required-r", self.required_r is not None), ("--robust", self.robust)):
                if given:
                    raise SpecificationError(f"{name} must go with --method paper, not with --method {self.method}")


@dataclass(frozen=True, eq=False)
class Fitted(View):
    """A version of a sensor's calibration."""

    made: Calibration

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences about what is wrong with it, if anything is."""
        return self.made.warnings

    def tables(self) -> list[Table]:
        """Return its figures, the intervals of readings, and the measurements with the largest residuals."""
        return calibration_tables(self.made)

    def as_dict(self) -> dict[str, Any]:
        """Return all of it in JSON types."""
        return calibration_json(self.made)


@dataclass(frozen=True, eq=False)
class Added(View):
    """What became of a file of measurements."""

    addition: Addition

    @property
    def good(self) -> int:
        """Number of valid rows."""
        return len(self.addition.file.readings)

    @property
    def refusals(self) -> tuple[Refusal, ...]:
        """The invalid rows: `line` and `reason` of each."""
        return self.addition.file.refusals

    @property
    def kept(self) -> bool:
        """Whether the valid rows were stored."""
        return self.addition.kept

    @property
    def fitted(self) -> Fitted:
        """The version fitted to them; raises ShortfallError if no polynomial is good enough."""
        if self.addition.calibration is None:
            raise ShortfallError(self.addition.shortfall)
        return Fitted(self.addition.calibration)

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence for each alarm that the days of the file raise, and for a last day beyond the warning limit."""
        return self.addition.warnings

    def tables(self) -> list[Table]:
        """Return how far the sensor reads from the version before, and whether it is healthy."""
        return [addition_table(self.addition)]

    def as_dict(self) -> dict[str, Any]:
        """Return all of it in JSON types."""
        return addition_json(self.addition)


@dataclass(frozen=True, eq=False)
class Referenced(View):
    """What reference targets say of a day."""

    morning: Morning

    @property
    def added(self) -> Added:
        """What became of the readings."""
        return Added(self.morning.addition)

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence for each target that does not count, and for each alarm and notice of the sensor's health."""
        return (*self.morning.warnings, *self.added.warnings)

    def tables(self) -> list[Table]:
        """Return the targets, the curve of the day, and the intervals of readings on it.

        Raises ShortfallError if no polynomial is good enough.
        """
        if self.morning.addition.calibration is None:
            raise ShortfallError(self.morning.addition.shortfall)
        return morning_tables(self.morning)

    def as_dict(self) -> dict[str, Any]:
        """Return all of it in JSON types."""
        return morning_json(self.morning)


@dataclass(frozen=True, eq=False)
class Removed:
    """What became of a calibration when a file was withdrawn."""

    withdrawn: Withdrawn

    @property
    def file(self) -> str:
        """Name of the file."""
        return self.withdrawn.source.name

    @property
    def measurements(self) -> int:
        """Number of its measurements, which count no more."""
        return self.withdrawn.source.measurements

    @property
    def fitted(self) -> Fitted:
        """The version without it; raises ShortfallError if no polynomial is good enough."""
        if self.withdrawn.calibration is None:
            raise ShortfallError(self.withdrawn.shortfall)
        return Fitted(self.withdrawn.calibration)

    def as_dict(self) -> dict[str, Any]:
        """Return all of it in JSON types."""
        made = self.withdrawn.calibration
        return source_json(self.withdrawn.source) | {
            "shortfall": self.withdrawn.shortfall,
            "calibration": None if made is None else calibration_json(made),
        }


@dataclass(frozen=True, eq=False)
class Files(View):
    """The files of a sensor, withdrawn ones too."""

    sensor: str
    sources: Sequence[Source]

    def tables(self) -> list[Table]:
        """Return a row for each, and a sentence for each withdrawal."""
        return [sources_table(self.sensor, self.sources)]

    def entries(self) -> list[dict[str, Any]]:
        """Return them in JSON types."""
        return [source_json(source) for source in self.sources]


@dataclass(frozen=True, eq=False)
class History(View):
    """All versions of a sensor's calibration."""

    sensor: str
    versions: Sequence[Version]

    def tables(self) -> list[Table]:
        """Return a row for each."""
        return [history_table(self.sensor, self.versions)]

    def entries(self) -> list[dict[str, Any]]:
        """Return them in JSON types."""
        return [version_json(self.sensor, version) for version in self.versions]


@dataclass(frozen=True, eq=False)
class Advised(View):
    """What to measure on a day, and what it is expected to bring."""

    sensor: str
    date: str
    within: float
    advice: Advice

    @property
    def shortfall(self) -> str:
        """A sentence if the wanted intervals cannot be reached, else empty."""
        if self.advice.reached:
            return ""
        return (
            f"the intervals must be within {self.within:g} mm, and {count(self.advice.count, 'measurement')} "
            f"bring{'s' * (self.advice.count == 1)} them to {max(self.advice.after):.3g} mm only"
        )

    def tables(self) -> list[Table]:
        """Return the plan, and the intervals without and with it."""
        return advice_tables(self.sensor, self.date, self.within, self.advice)

    def as_dict(self) -> dict[str, Any]:
        """Return all of it in JSON types."""
        return advice_json(self.sensor, self.date, self.within, self.advice)


@dataclass(frozen=True, eq=False)
class Checked(View):
    """Whether a sensor still behaves as its measurements so far and its type predict."""

    sensor: str
    health: Health

    @property
    def alarms(self) -> int:
        """Number of alarms that stand."""
        return len(self.health.alarms)

    def picture(self, file_format: str) -> bytes:
        """Draw the control charts, as "svg" or "png"."""
        from sosmith.instrument.calibration.health.health_plot import health_plot

        return health_plot(self.sensor, self.health, file_format)

    def tables(self) -> list[Table]:
        """Return the charts, with a sentence for each alarm and for a last day beyond the warning limit."""
        return [health_table(self.sensor, self.health)]

    def as_dict(self) -> dict[str, Any]:
        """Return all of it in JSON types."""
        return health_json(self.sensor, self.health)


def day_of(text: str | None) -> str:
    """Return a date of the form ``YYYY-MM-DD``, today by default; raises SpecificationError if it is none."""
    return datetime.date.today().isoformat() if text is None else parse_date(text)


class CalibrationStore:
    """Measurements of sensors and the calibrations fitted to them, in one SQLite file.

    Each method opens the file and closes it again; what it adds is on disk when it returns. All raise
    SpecificationError if the file is no store or the sensor is unknown, and ToolError if the file cannot be read or
    written.

    Parameters
    ----------
    path : path
        The file; `add` makes it.
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        self.path = Path(fspath(path))

    def add(
        self,
        sensor: str,
        file: str | PathLike[str],
        date: str,
        options: FitOptions,
        *,
        ranges: tuple[Range | None, Range | None, Range | None] = (None, None, None),
        keep_good: bool = False,
        surprising: bool = False,
        progress: Progress = lambda step, done, total: None,
    ) -> Added:
        """Add the measurements of a CSV or XLSX file, and fit again.

        Parameters
        ----------
        sensor : str
            Its name.
        file : path
            The file.
        date : str
            Date of measurements that have none, and of the version.
        options : FitOptions
            How to fit.
        ranges : tuple of Range or None
            Valid clearances in mm, voltages in V and temperatures in degC from now on; None leaves them as they are.
        keep_good : bool
            Whether to store the valid rows of a file that has invalid ones.
        surprising : bool
            Whether to store a file that looks like a slip: other units, swapped columns, another sensor.
        progress : callable
            Called with the name of each step, and how far it is.
        """
        source = Path(fspath(file))
        options.check()
        progress(f"adding {source}", 0, 0)
        if not self.path.exists():
            refused = refused_first_file(sensor, source, date, ranges=ranges, keep_good=keep_good)
            if refused is not None:
                return Added(refused)
        with open_store(self.path, create=True) as store:
            told = _told(progress, "fitting")
            addition = add(
                store,
                sensor,
                source,
                date,
                ranges=ranges,
                keep_good=keep_good,
                surprising=surprising,
                progress=told,
                **options.settings(store, sensor),
            )
        return Added(addition)

    def fit(
        self,
        sensor: str,
        date: str,
        options: FitOptions,
        progress: Progress = lambda step, done, total: None,
    ) -> Fitted:
        """Fit to all measurements of a sensor; raises ShortfallError if no polynomial is good enough."""
        options.check()
        step = f"fitting {sensor}"
        with open_store(self.path) as store:
            progress(step, 0, 0)
            settings = options.settings(store, sensor)
            return Fitted(refit(store, sensor, date, progress=_told(progress, step), **settings))

    def reference(
        self,
        sensor: str,
        targets: str | PathLike[str] | Sequence[Sequence[float]],
        date: str,
        *,
        uncertainty: float = 0.02,
        source: str = "by hand",
        surprising: bool = False,
        order: int | None = None,
        progress: Progress = lambda step, done, total: None,
    ) -> Referenced:
        """Add readings of reference targets, and calibrate for their day.

        Parameters
        ----------
        sensor : str
            Its name; it must have measurements already.
        targets : path, or sequence of tuple of float
            CSV or XLSX file; or readings, each the target's clearance in mm, voltage in V and temperature in degC, and
            optionally the standard uncertainties of all three, 0 for what is not stated.
        date : str
            The day.
        uncertainty : float
            Standard uncertainty in mm of a target's clearance, where the file states none.
        source : str
            Where readings are from that are in no file.
        surprising : bool
            As for `add`.
        order : int or None
            As in `FitOptions`.
        progress : callable
            Called with the name of each step, and how far it is.
        """
        content = None
        if isinstance(targets, str | PathLike):
            path = Path(fspath(targets))
        else:
            path, content = by_hand(date, targets, source)
        with open_store(self.path) as store:
            told = _told(progress, "fitting")
            kind = FitOptions(order=order).settings(store, sensor)["sensor_type"]
            morning = reference(
                store,
                sensor,
                path,
                date,
                uncertainty,
                content=content,
                surprising=surprising,
                sensor_type=kind,
                progress=told,
            )
        return Referenced(morning)

    def files(self, sensor: str) -> Files:
        """Return the files of a sensor in the order in which they were added."""
        with open_store(self.path) as store:
            return Files(sensor, sources_of(store, sensor))

    def withdraw(
        self,
        sensor: str,
        name: str,
        date: str,
        *,
        author: str,
        reason: str,
        progress: Progress = lambda step, done, total: None,
    ) -> Removed:
        """Withdraw a file, and fit again without it. It stays in the store, and the versions fitted to it as well.

        Parameters
        ----------
        sensor : str
            Its name.
        name : str
            Name of the file as it was added, or its number.
        date : str
            Date of the withdrawal, and of the new version.
        author, reason : str
            Who withdraws it, and why.
        progress : callable
            Called with the name of each step, and how far it is.
        """
        with open_store(self.path) as store:
            step = f"fitting {sensor}"
            progress(step, 0, 0)
            return Removed(withdraw(store, sensor, name, date, author, reason, _told(progress, step)))

    def history(
        self, sensor: str, *, verify: bool = False, progress: Progress = lambda step, done, total: None
    ) -> History:
        """Return all versions; with `verify`, raise ShortfallError unless each is reproduced bit by bit."""
        with open_store(self.path) as store:
            newest = find_version(store, sensor)
            versions = store.versions(sensor)
            if verify:
                progress("checking the file", 0, 0)
                store.check()
                for version in versions:
                    progress("fitting again", version.number, newest.number)
                    calibration_of(store, sensor, version.number)
        return History(sensor, versions)

    def version(self, sensor: str, number: int | None = None) -> Version:
        """Return a version, the newest by default."""
        with open_store(self.path) as store:
            return find_version(store, sensor, number)

    def specification(self, sensor: str, number: int | None = None, room: float | None = None) -> tuple[str, str]:
        """Return ``[calibration]`` as TOML, of hardware with `room` in mm if given; why its uncertainty is left out."""
        with open_store(self.path) as store:
            version, ranges = find_version(store, sensor, number), store.ranges(sensor)
            if room is not None and ranges is not None:
                return design_table(sensor, version, ranges[1:], room), ""
            try:
                return specification_table(sensor, version, calibration_of(store, sensor, version.number)), ""
            except ShortfallError as error:
                return specification_table(sensor, version), str(error)

    def measurements(self, sensor: str, number: int | None = None) -> str:
        """Return the measurements of a version as CSV, for the key ``calibration.data`` of a specification."""
        with open_store(self.path) as store:
            version = find_version(store, sensor, number)
            return measurements_csv(store.measurements(sensor, version.last_measurement, version.last_withdrawal))

    def picture(
        self,
        sensor: str,
        file_format: str,
        number: int | None = None,
        progress: Progress = lambda step, done, total: None,
    ) -> bytes:
        """Draw coverage, residuals, leverage and history of a version, as "svg" or "png"."""
        from sosmith.instrument.calibration.calibration_plot import calibration_plot

        with open_store(self.path) as store:
            progress("fitting again", 0, 0)
            made = calibration_of(store, sensor, number)
            versions = store.versions(sensor)[: made.version.number]
            progress("drawing", 0, 0)
            return calibration_plot(made, versions, file_format)

    def advice(
        self,
        sensor: str,
        date: str,
        clearances: tuple[float, ...],
        *,
        temperatures: tuple[float, ...] = (),
        within: float = 0.2,
        most: int = 60,
        uncertainty: float = 0.0,
    ) -> Advised:
        """Say what to measure on a day, to know these clearances in mm within an interval in mm.

        Parameters
        ----------
        sensor, date : str
            The sensor, and a day after its last measurement.
        clearances : tuple of float
            Where the readings must be good, in mm.
        temperatures : tuple of float
            Of the readings and the measurements, in degC; by default the lowest, middle and highest one measured.
        within : float
            Wanted half-width of the 95 % interval, in mm.
        most : int
            Most measurements.
        uncertainty : float
            Standard uncertainty in mm of what is measured, as of reference targets; 0 if it scatters as before.
        """
        with open_store(self.path) as store:
            found = advice_for(store, sensor, date, clearances, temperatures, within, most, uncertainty)
        return Advised(sensor, date, within, found)

    def health(self, sensor: str, since: str | None = None) -> Checked:
        """Go through the days of a sensor, with charts from a date on."""
        with open_store(self.path) as store:
            return Checked(sensor, health_for(store, sensor, since))


def _told(progress: Progress, step: str) -> Callable[[int, int], None]:
    return lambda tried, count: progress(step, tried, count)
