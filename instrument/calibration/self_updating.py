"""The self-updating calibration: each file added to the store gives a new version of the polynomial."""

from __future__ import annotations

import datetime
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sosmith.gen.calibration.acceptance import REQUIRED_R
from sosmith.gen.calibration.fit import (
    Accept,
    Fit,
    Measurements,
    Progress,
    fit,
    unacceptable,
    untold,
)
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES, Method, Range
from sosmith.instrument.calibration.advice import Advice, advise
from sosmith.instrument.calibration.bayesian_fit import BayesianFit, bayesian_fit
from sosmith.instrument.calibration.covered_region import CoveredRegion
from sosmith.instrument.calibration.fit_quality import FitQuality, assess, assess_posterior
from sosmith.instrument.calibration.health.monitoring import Health, health_of
from sosmith.instrument.calibration.measurement_store import (
    MeasurementStore,
    StoredMeasurement,
    Version,
    as_measurements,
    data_sha256,
)
from sosmith.instrument.calibration.rails import Rails, rails_of
from sosmith.instrument.calibration.sensor_type import SensorType
from sosmith.instrument.calibration.store.measurement_files import (
    MeasurementFile,
    Refusal,
    read_measurement_file,
)
from sosmith.instrument.calibration.store.shift import Shift, shift_from
from sosmith.instrument.calibration.store.surprise import surprise_of
from sosmith.instrument.calibration.uncertainty import largest_half_width
from sosmith.model.errors import ShortfallError, SpecificationError

DAYS_A_YEAR = 365.25

FAR = 180
"""Days between the last measurement and the day of a calibration from which on the drift that it assumes is told."""


@dataclass(frozen=True)
class Calibration:
    """A version of the calibration, with what its report needs.

    Attributes
    ----------
    sensor : str
        Name of the sensor.
    version : Version
        The version itself.
    new : bool
        Whether this call created it; False if nothing had changed since the last version.
    stored : list of StoredMeasurement
        The measurements it was fitted to.
    fit : Fit
        The fit.
    quality : FitQuality
        Quality of the fit.
    ranges : tuple of Range
        Valid ranges of the sensor: clearance in mm, voltage in V, temperature in degC.
    drift : dict
        Largest difference in mm from each earlier version, by its number, over the region covered now.
    date : str
        The day that was asked for.
    bayesian : BayesianFit or None
        The model behind the fit; None for the paper's method.
    """

    sensor: str
    version: Version
    new: bool
    stored: Sequence[StoredMeasurement]
    fit: Fit
    quality: FitQuality
    ranges: tuple[Range, Range, Range]
    drift: dict[int, float]
    date: str
    bayesian: BayesianFit | None = None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences about what is wrong with the calibration, if anything is."""
        lack = self.quality.uncertainty.lack
        found = [lack.warning] if lack.structured else []
        if self.bayesian is not None:
            found += [text for text in (self.bayesian.surprise,) if text]
            found += [f"{text}; they are left out" for text in self.bayesian.rails.found]
            step = self.bayesian.step.sentence if self.bayesian.step is not None else ""
            found += [text for text in (self._far, self.bayesian.missed, step, *self.bayesian.doubts) if text]
        else:
            found += [f"{text}; --method bayes leaves them out" for text in self._rails.found]
        return tuple(found)

    @property
    def _far(self) -> str:
        """A sentence if the day of the calibration is before the last measurement, or long after it."""
        last, date = max(one.reading.date for one in self.stored), self.date
        days = (datetime.date.fromisoformat(date) - datetime.date.fromisoformat(last)).days
        if days < 0:
            return f"{date} is before the last measurement: the calibration is for {last}"
        known = self.version.sensor_type
        if days < FAR or known is None:
            return ""
        offset, gain = (drift * math.sqrt(days) for drift in (known.offset_drift, known.gain_drift))
        return (
            f"{date} is {days / DAYS_A_YEAR:.1f} years after the last measurement, of {last}: the intervals assume a "
            f"drift of {offset:.2g} V and {100 * gain:.2g} % of the gain since then, as standard deviations"
        )

    @property
    def _rails(self) -> Rails:
        return rails_of(as_measurements(self.stored, self.sensor), self.ranges[1])

    @property
    def coverage(self) -> float:
        """Share of the sensor's range of voltage and temperature that the measurements enclose."""
        _, (v_low, v_high), (t_low, t_high) = self.ranges
        return self.quality.region.area / ((v_high - v_low) * (t_high - t_low))


@dataclass(frozen=True)
class Addition:
    """Result of adding a file.

    Attributes
    ----------
    file : MeasurementFile
        Its rows; those already in the store count as rejected.
    kept : bool
        Whether the valid rows were stored.
    calibration : Calibration or None
        The resulting version; None if nothing was stored or no polynomial is good enough.
    shortfall : str
        Reason why there is no version although rows were stored; empty otherwise.
    shift : Shift or None
        How far the sensor now reads from the version before; None without one, or if nothing was stored.
    health : Health or None
        The sensor's health with the rows; None if nothing was stored.
    """

    file: MeasurementFile
    kept: bool
    calibration: Calibration | None
    shortfall: str
    shift: Shift | None = None
    health: Health | None = None

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence for each alarm that the days of the file have raised, and for the last day beyond its limit."""
        if self.health is None:
            return ()
        first, notice = min((reading.date for reading in self.file.readings), default=""), self.health.notice
        found = [alarm.sentence for alarm in self.health.alarms if alarm.raised >= first]
        return (*found, *([notice.sentence] if notice is not None and notice.date >= first else []))


def add(
    store: MeasurementStore,
    sensor: str,
    path: Path,
    date: str,
    *,
    ranges: tuple[Range | None, Range | None, Range | None] = (None, None, None),
    keep_good: bool = False,
    surprising: bool = False,
    content: bytes | None = None,
    uncertainty: float = 0.0,
    method: Method = "paper",
    sensor_type: SensorType | None = None,
    required_r: float = REQUIRED_R,
    robust: bool = False,
    accept: float | None = None,
    progress: Progress = untold,
) -> Addition:
    """Add a file to the store and fit again, in one transaction.

    Parameters
    ----------
    store : MeasurementStore
        The store.
    sensor : str
        Name of the sensor; created if it is new.
    path : Path
        CSV or XLSX file.
    date : str
        Date of measurements that have none in the file, and of the version.
    ranges : tuple of Range or None
        New valid ranges of clearance in mm, voltage in V and temperature in degC; None keeps the present one.
    keep_good : bool
        Whether to store the valid rows of a file that also has rejected ones.
    surprising : bool
        Whether to store a file that looks like a slip; see `surprise_of`.
    content, uncertainty
        As for `read_measurement_file`.
    method : str
        "paper" for the paper's rule, `fit`; "bayes" for `bayesian_fit`, for the day of the version.
    sensor_type : SensorType or None
        New type of the sensor, the prior of the method "bayes"; None keeps the present one.
    required_r, robust, progress
        As in `fit`; the first two are of the method "paper" only.
    accept : float or None
        Largest half-width in mm of the interval of a reading's clearance, over the region that the measurements
        cover; None if not limited.

    Raises
    ------
    SpecificationError
        As for `read_measurement_file`; if the file was added before; if it looks like a slip and `surprising` is false.
        Nothing is written then.
    """
    _check_sensor(sensor)
    with store.transaction():
        before = store.ranges(sensor)
        usual = before or DEFAULT_RANGES
        now = _ranges_from_now_on(ranges, usual)
        file = read_measurement_file(path, date, now, content=content, uncertainty=uncertainty)
        for source in store.sources(sensor):
            if source.sha256 == file.sha256 and source.withdrawal is None:
                raise SpecificationError(f"{path} must hold new measurements, not those already added as {source.name}")
        file = _sift(store, sensor, file)
        if not _keeps(file, keep_good=keep_good):
            return Addition(file, False, None, "")
        kind = sensor_type or store.sensor_type(sensor)
        versions = store.versions(sensor)
        known, added = as_measurements(store.measurements(sensor), sensor), _measurements_of(file)
        if not surprising:
            counted = versions[-1] if versions and len(known) else None
            slip = surprise_of(added, known, counted, kind if counted or method == "bayes" else None)
            if slip:
                raise SpecificationError(f"{path}: {slip}; --surprising stores them as they are")
        if now != before:
            store.set_ranges(sensor, now)
        if sensor_type is not None:
            store.set_sensor_type(sensor, sensor_type)
        store.insert(sensor, file)
        shift = shift_from(versions[-1], known, added) if versions and len(known) else None
        health = health_for(store, sensor)
        try:
            settings = Settings(method, required_r, robust, accept, kind)
            return Addition(file, True, fit_version(store, sensor, date, settings, progress), "", shift, health)
        except SpecificationError as error:
            return Addition(file, True, None, str(error), shift, health)


def refused_first_file(
    sensor: str,
    path: Path,
    date: str,
    *,
    ranges: tuple[Range | None, Range | None, Range | None] = (None, None, None),
    keep_good: bool = False,
) -> Addition | None:
    """Check the first file of a new store: return the result if nothing of it would be stored, else None.

    Call it before `open_store` creates the store, so that a rejected file leaves no empty store behind.

    Raises
    ------
    SpecificationError
        As for `read_measurement_file`.
    """
    _check_sensor(sensor)
    file = read_measurement_file(path, date, _ranges_from_now_on(ranges, DEFAULT_RANGES))
    return None if _keeps(file, keep_good=keep_good) else Addition(file, False, None, "")


def refit(
    store: MeasurementStore,
    sensor: str,
    date: str,
    *,
    method: Method = "paper",
    sensor_type: SensorType | None = None,
    required_r: float = REQUIRED_R,
    robust: bool = False,
    accept: float | None = None,
    progress: Progress = untold,
) -> Calibration:
    """Fit to all measurements of a sensor. A new version is created only if something has changed.

    Raises
    ------
    SpecificationError
        If the sensor has no measurements.
    ShortfallError
        If no polynomial is good enough.

    The parameters are those of `add`.
    """
    with store.transaction():
        known_sensor(store, sensor)
        if sensor_type is not None:
            store.set_sensor_type(sensor, sensor_type)
        try:
            settings = Settings(method, required_r, robust, accept, store.sensor_type(sensor))
            return fit_version(store, sensor, date, settings, progress)
        except SpecificationError as error:
            raise ShortfallError(str(error)) from None


def find_version(store: MeasurementStore, sensor: str, number: int | None = None) -> Version:
    """Return a version; the newest if `number` is None.

    Raises
    ------
    SpecificationError
        If the sensor or version does not exist.
    """
    known_sensor(store, sensor)
    versions = store.versions(sensor)
    if not versions:
        raise SpecificationError(f"{store.path}: sensor {sensor} must have a fitted version, not only measurements")
    if number is None:
        return versions[-1]
    if not 1 <= number <= len(versions):
        raise SpecificationError(f"the version of sensor {sensor} must be 1 to {len(versions)}, not {number}")
    return versions[number - 1]


def calibration_of(store: MeasurementStore, sensor: str, number: int | None = None) -> Calibration:
    """Reproduce a version from the store; the newest if `number` is None.

    Raises
    ------
    SpecificationError
        As for `find_version`.
    ShortfallError
        If the result differs from the stored version in any bit.
    """
    version = find_version(store, sensor, number)
    stored = store.measurements(sensor, version.last_measurement, version.last_withdrawal)
    try:
        settings = settings_of(version)
        again = _calibration(store, sensor, stored, version.date, settings, version)
    except SpecificationError as error:
        raise ShortfallError(
            f"version {version.number} of sensor {sensor} must be reproducible, not fail: {error}"
        ) from None
    if again.version != version:
        raise ShortfallError(
            f"version {version.number} of sensor {sensor} must be reproducible, not give another polynomial"
        )
    return again


def advice_for(
    store: MeasurementStore,
    sensor: str,
    date: str,
    clearances: tuple[float, ...],
    temperatures: tuple[float, ...],
    within: float,
    most: int,
    uncertainty: float = 0.0,
) -> Advice:
    """Return what to measure on `date`, a day after the last measurement; see `advise`.

    Without `temperatures`, the lowest, middle and highest one measured are taken.

    Raises
    ------
    SpecificationError
        If the sensor has no measurements, or `date` is not after the last of them; as for `bayesian_fit` and `advise`.
    """
    known_sensor(store, sensor)
    ranges = store.ranges(sensor)
    assert ranges is not None, "a sensor has ranges"
    measurements = as_measurements(store.measurements(sensor), f"{store.path}, sensor {sensor}")
    day, last = datetime.date.fromisoformat(date).toordinal(), max(measurements.days)
    if day <= last:
        raise SpecificationError(
            f"the day to measure on must be after {datetime.date.fromordinal(last)}, that of the last measurement, "
            f"not {date}"
        )
    made = bayesian_fit(measurements, store.sensor_type(sensor), day, ranges)
    low, high = measurements.covered[1]
    usual = (low, (low + high) / 2, high)
    return advise(
        made,
        ranges,
        clearances,
        temperatures or usual,
        within=within,
        days=day - last,
        most=most,
        uncertainty=uncertainty,
    )


def health_for(store: MeasurementStore, sensor: str, since: str | None = None) -> Health:
    """Return the health of a sensor, with charts from the date `since` on; see `health_of`.

    Raises
    ------
    SpecificationError
        If the sensor has no measurements; as for `health_of`.
    """
    known_sensor(store, sensor)
    ranges = store.ranges(sensor)
    assert ranges is not None, "a sensor has ranges"
    measurements = as_measurements(store.measurements(sensor), f"{store.path}, sensor {sensor}")
    first = None if since is None else datetime.date.fromisoformat(since).toordinal()
    return health_of(measurements, store.sensor_type(sensor), rails_of(measurements, ranges[1]).ends, first)


def known_sensor(store: MeasurementStore, sensor: str) -> None:
    """Raise SpecificationError if the store has no such sensor."""
    sensors = store.sensors()
    if not sensors:
        raise SpecificationError(f"{store.path} must hold measurements; sosmith calibrate add adds them")
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
    """Whether the valid rows of a file will be stored."""
    return bool(file.readings) and (keep_good or not file.refusals)


def _measurements_of(file: MeasurementFile) -> Measurements:
    clearance, voltage, temperature = np.array([reading.values for reading in file.readings]).T
    days = tuple(datetime.date.fromisoformat(reading.date).toordinal() for reading in file.readings)
    stated = np.array([reading.uncertainty for reading in file.readings]).T
    return Measurements(clearance, voltage, temperature, str(file.path), days, stated if stated.any() else None)


def _sift(store: MeasurementStore, sensor: str, file: MeasurementFile) -> MeasurementFile:
    """Reject rows that are already in the store."""
    known = {one.reading.key: one for one in store.measurements(sensor)}
    refusals = list(file.refusals)
    readings = []
    for reading in file.readings:
        if reading.key in known:
            one = known[reading.key]
            where = f"measurement {one.number} ({one.source}, line {one.reading.line}, {one.reading.date})"
            refusals.append(Refusal(reading.line, f"row must be a new measurement, not a duplicate of {where}"))
        else:
            readings.append(reading)
    refusals.sort(key=lambda refusal: refusal.line)
    return replace(file, readings=tuple(readings), refusals=tuple(refusals))


@dataclass(frozen=True)
class Settings:
    """How to fit: the parameters of `add`."""

    method: Method
    required_r: float
    robust: bool
    accept: float | None
    sensor_type: SensorType | None


def settings_of(version: Version) -> Settings:
    """Return how a version was fitted."""
    return Settings(version.method, version.required_r, version.robust, version.accept, version.sensor_type)


def fit_version(store: MeasurementStore, sensor: str, date: str, settings: Settings, progress: Progress) -> Calibration:
    """Fit to all measurements of a sensor; a new version is stored if something has changed.

    Raises
    ------
    SpecificationError
        If none counts, or no polynomial is good enough.
    """
    versions = store.versions(sensor)
    stored = store.measurements(sensor)
    if not stored:
        raise SpecificationError(f"{store.path}, sensor {sensor} must hold a file that counts, not none")
    made = _calibration(store, sensor, stored, date, settings, None, progress)
    if versions:
        newest = versions[-1]
        last = max(one.reading.date for one in stored)
        # A Bayesian calibration is for a day, on which its intervals depend.
        same_day = made.bayesian is None or max(date, last) == max(newest.date, last)
        same = {name: getattr(newest, name) for name in ("number", "date", "drift")}
        if same_day and replace(made.version, **same) == newest:
            return replace(made, version=newest, new=False, drift={k: made.drift[k] for k in range(1, newest.number)})
    store.insert_version(sensor, made.version)
    return replace(made, new=True)


def _calibration(
    store: MeasurementStore,
    sensor: str,
    stored: Sequence[StoredMeasurement],
    date: str,
    settings: Settings,
    again: Version | None,
    progress: Progress = untold,
) -> Calibration:
    """Fit a new version, or that of `again` once more, and compare with those before it."""
    earlier = store.versions(sensor)
    number = len(earlier) + 1 if again is None else again.number
    measurements: Measurements = as_measurements(stored, f"{store.path}, sensor {sensor}")
    ranges = store.ranges(sensor)
    assert ranges is not None, "measurements belong to a sensor"
    made, bayesian, accept = None, settings.method == "bayes", settings.accept
    if bayesian and settings.sensor_type is not None:
        day = datetime.date.fromisoformat(date).toordinal()
        made = bayesian_fit(measurements, settings.sensor_type, day, ranges, progress)
        fitted, quality = made.fit, assess_posterior(measurements, made)
        if accept is not None and quality.uncertainty.limits[1] > accept:
            raise SpecificationError(unacceptable(measurements, accept, quality.uncertainty.limits[1]))
    else:
        limit = None if accept is None else Accept(accept, largest_half_width)
        fitted = fit(measurements, settings.required_r, robust=settings.robust, accept=limit, progress=progress)
        quality = assess(measurements, fitted)
    region: CoveredRegion = quality.region
    drift = {
        version.number: region.largest_difference(fitted.polynomial, version.polynomial)
        for version in earlier[: number - 1]
    }
    version = Version(
        number=number,
        date=date,
        measurements=len(stored),
        last_measurement=stored[-1].number,
        data_sha256=data_sha256(stored, sensor),
        required_r=0.0 if bayesian else settings.required_r,
        robust=settings.robust and not bayesian,
        polynomial=fitted.polynomial,
        adjusted_r_squared=fitted.adjusted_r_squared,
        rms=fitted.rms,
        cross_validated=quality.cross_validated,
        drift=drift.get(number - 1),
        method=settings.method,
        sensor_type=settings.sensor_type if bayesian else None,
        accept=accept,
        last_withdrawal=store.last_withdrawal(sensor) if again is None else again.last_withdrawal,
    )
    return Calibration(sensor, version, False, stored, fitted, quality, ranges, drift, date, made)
