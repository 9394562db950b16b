"""The morning's routine: reference targets of known clearance give the curve of the day."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sosmith.gen.calibration.fit import COLUMNS, UNCERTAINTY_COLUMNS, Progress, untold
from sosmith.instrument.calibration.bayesian_fit import bayesian_fit
from sosmith.instrument.calibration.measurement_store import MeasurementStore, as_measurements
from sosmith.instrument.calibration.self_updating import Addition, add, known_sensor
from sosmith.instrument.calibration.sensor_type import SYSTEMATIC_FACTOR, SensorType
from sosmith.instrument.calibration.store.measurement_files import Reading
from sosmith.instrument.calibration.uncertainty import of_posterior
from sosmith.model.errors import SpecificationError

GROSS = 4.0
"""A target that is off by more than so many standard deviations of what may be expected of a day is told."""

ByHand = Sequence[float]
"""A reading that is in no file: clearance of the target in mm, voltage in V, temperature in degC.

Then, optionally, their standard uncertainties in the same units, 0 for one that is not stated.
"""


@dataclass(frozen=True)
class Target:
    """One reading of a target.

    Attributes
    ----------
    reading : Reading
        Its clearance, what was read there, and how well they are known.
    before, after : tuple of float
        Clearance in mm by the calibration for this day, and the half-width of its 95 % interval, without the targets
        and with all of them.
    """

    reading: Reading
    before: tuple[float, float]
    after: tuple[float, float]


@dataclass(frozen=True)
class Morning:
    """What the targets of a day say: the addition with the version for that day, and each reading."""

    addition: Addition
    targets: tuple[Target, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence for each target that no error of a day explains, and for each that is left out as an outlier."""
        made = self.addition.calibration
        if made is None or made.version.sensor_type is None:
            return ()
        widest = GROSS * SYSTEMATIC_FACTOR * made.version.sensor_type.systematic
        found = []
        for target, weight in zip(self.targets, made.fit.weights[-len(self.targets) :], strict=True):
            clearance, (read, half_width) = target.reading.values[0], target.before
            what = f"the target of {clearance:g} mm reads {read:.3f} mm by the calibration before"
            if not weight:
                found.append(f"{what}; it is left out, off the curve of all others")
            elif abs(read - clearance) > max(widest, GROSS / 2 * half_width):
                found.append(f"{what}, too far off for an error of a day; sosmith calibrate withdraw if it was another")
        return tuple(found)


def by_hand(date: str, readings: Sequence[ByHand], source: str = "by hand") -> tuple[Path, bytes]:
    """Return readings that are in no file as one: its name, which says where they are from, and its content."""
    rows = [",".join((*COLUMNS, *UNCERTAINTY_COLUMNS))]
    for one in readings:
        stated = [repr(float(value)) if value else "" for value in one[3:]]
        rows.append(",".join([*(repr(float(value)) for value in one[:3]), *stated, *[""] * (6 - 3 - len(stated))]))
    return Path(f"{source}, {date}.csv"), "\n".join([*rows, ""]).encode()


def reference(
    store: MeasurementStore,
    sensor: str,
    path: Path,
    date: str,
    uncertainty: float,
    *,
    content: bytes | None = None,
    surprising: bool = False,
    sensor_type: SensorType | None = None,
    progress: Progress = untold,
) -> Morning:
    """Add the readings of reference targets, and calibrate for their day.

    Parameters
    ----------
    store, sensor, path, date, content, surprising, sensor_type, progress
        As for `add`.
    uncertainty : float
        Standard uncertainty in mm of a target's clearance, where the file states none.

    Raises
    ------
    SpecificationError
        If the sensor has no measurements yet; if a row is invalid; as for `add`.
    ShortfallError
        If no calibration can be made.
    """
    known_sensor(store, sensor)
    ranges = store.ranges(sensor)
    assert ranges is not None, "a sensor has ranges"
    before = as_measurements(store.measurements(sensor), f"{store.path}, sensor {sensor}")
    addition = add(
        store,
        sensor,
        path,
        date,
        surprising=surprising,
        content=content,
        uncertainty=uncertainty,
        method="bayes",
        sensor_type=sensor_type,
        progress=progress,
    )
    if not addition.kept:
        one = addition.file.refusals[0]
        raise SpecificationError(f"{path}, line {one.line}: {one.reason}")
    made = addition.calibration
    if made is None:
        return Morning(addition, ())
    readings = addition.file.readings
    V, T = (np.array([one.values[k] for one in readings]) for k in (1, 2))
    day = datetime.date.fromisoformat(date).toordinal()
    old = bayesian_fit(before, store.sensor_type(sensor), day, ranges)
    without, now = of_posterior(before, old).half_width(V, T), made.quality.uncertainty.half_width(V, T)
    targets = zip(
        readings,
        zip(old.fit.polynomial(V, T).tolist(), without.tolist(), strict=True),
        zip(made.fit.polynomial(V, T).tolist(), now.tolist(), strict=True),
        strict=True,
    )
    return Morning(addition, tuple(Target(*one) for one in targets))
