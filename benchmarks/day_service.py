"""26 days of service of an axle, with and without targets, filter and known sum: a part of `python -m benchmarks.days`.

Both wheels wear by 0.05 mm a day, and by 0.45 mm more on one day of bad track; each has a sensor of its own, calibrated
on the ten days before the service, whose day errs as on the paper's bench. Each day gives one reading of each wheel, in
double precision and by the integers of the hardware with the curve of the day.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
from benchmarks.day_bench import SET_ERROR, TYPE, before_targets, with_targets
from examples.wear_campaign.methods import measured
from scipy.signal import sosfilt

from sosmith.gen.calibration.fit import Measurements
from sosmith.gen.core import CoreDesign
from sosmith.gen.reload.reload import check_swap, other_set
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES
from sosmith.instrument.calibration.bayesian_fit import BayesianFit, bayesian_fit
from sosmith.instrument.calibration.mixed_effects.day_polynomial import polynomial_of
from sosmith.instrument.calibration.mixed_effects.model import Posterior, mixture_half_width
from sosmith.instrument.calibration.sensor_type import SensorType
from sosmith.instrument.scenarios.file import ScenarioFile
from sosmith.instrument.uncertainty.instrument_budget import slopes
from sosmith.instrument.wear.state_space import DayReading, DayState, WearModel, filtered
from sosmith.model.arithmetic.random_streams import streams
from sosmith.model.arrays import Values
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.stacked import compute_stacked
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial
from sosmith.model.reference.golden import filtered as smooth

SCENARIO = "bench_92_96"
"""Sensor, depot and errors of the days; the service takes the place of its run."""

DAYS, RATE, JUMP = 26, 0.05, 0.45
"""Length of the service, wear in mm a day, and wear of the day on bad track in mm."""

FIRST = (2.5, 2.9)
"""Clearances in mm of both wheels at first."""

SAMPLES, KEPT = 60, 30
"""Samples of a reading at 6 Hz, and those at its end whose mean it is."""

SUM_KNOWN_TO = 0.03
"""Standard uncertainty in mm of the sum of both clearances, new each day."""

SHARE, NORMAL = 0.95, 1.959964
"""Probability of the intervals, and their half-width in standard deviations of a normal distribution."""


@dataclass(frozen=True, eq=False)
class Wheel:
    """One wheel in service, over the days; lengths in mm.

    Attributes
    ----------
    true, double, uncertainty : ndarray, shape (days,)
        Clearance, reading in double precision, and standard uncertainty of what is new each day.
    shared : ndarray, shape (days,)
        Standard uncertainty by what the days share, the sensor's deviations: it differs with the temperature.
    codes : ndarray, shape (samples, days, 2)
        What the hardware took.
    sets : list of Datapath
        Its datapath on each day.
    refused : int
        Sets that the hardware refused: it went on with that of the day before.
    """

    true: Values
    double: Values
    uncertainty: Values
    shared: Values
    codes: npt.NDArray[np.int64]
    sets: list[Datapath]
    refused: int


def true_clearances(seed: int) -> Values:
    """Return the clearances of both wheels over the days; shape (2, days)."""
    day = int(streams(seed, "service")("bad track").integers(5, DAYS - 6))
    worn = RATE * np.arange(DAYS) + JUMP * (np.arange(DAYS) >= day)
    return np.array(FIRST)[:, None] + worn


def in_service(
    scenario: ScenarioFile,
    core: CoreDesign,
    seed: int,
    wheel: int,
    true: Values,
    *,
    targets: bool,
    sensor_type: SensorType = TYPE,
) -> Wheel:
    """Read one wheel over the days; with `targets`, two gauges of whole millimetres about it are read each morning."""
    sensor = 2 * seed + wheel
    first = scenario.document.start.toordinal()
    known, made = _before(scenario, sensor, sensor_type)
    so_far = before_targets(made)
    chance = streams(sensor, "service of a wheel")
    double, uncertainty, shared, taken, sets = list[float](), list[float](), list[float](), [], list[Datapath]()
    polynomial: Polynomial | None = None
    refused, expected, noise = 0, float(true[0]), reading_noise(core, scenario.sensors.inductive.noise)
    datapath = core.datapath
    for k, clearance in enumerate(true.tolist()):
        day = max(known.days) + 1 + k
        state = scenario.sensors.inductive.state(float(day - first), streams(sensor, "life of the sensor"))
        if targets:
            low = max(float(np.floor(expected)), 2.0)
            empty = Measurements(*(np.zeros(0) for _ in range(3)), "targets", ())
            morning = with_targets(empty, scenario, state, day, (low, low + 1.0), sensor)
            so_far = so_far.on(morning, np.ones(2), day)
        else:
            so_far = so_far.without(day)
        if targets or polynomial is None:
            polynomial, _ = polynomial_of(so_far.posterior, known, made.region, DEFAULT_RANGES)
            datapath, refusal = _loaded(core, polynomial, datapath)
            refused += refusal
        V, T, codes = _read(scenario, core, state, clearance, chance, k)
        values = smooth(polynomial(V, T), core.quantized.filter.sos, core.datapath.output, steady=core.quantized.steady)
        expected = float(np.mean(values[-KEPT:]))
        new, common = _uncertainty(so_far.posterior, polynomial, V[-1:], T[-1:], noise)
        for values_so_far, value in ((double, expected), (uncertainty, new), (shared, common)):
            values_so_far.append(value)
        taken.append(codes)
        sets.append(datapath)
    return Wheel(
        true=true,
        double=np.array(double),
        uncertainty=np.array(uncertainty),
        shared=np.array(shared),
        codes=np.stack(taken, axis=1),
        sets=sets,
        refused=refused,
    )


@lru_cache(maxsize=2)
def _before(scenario: ScenarioFile, sensor: int, sensor_type: SensorType) -> tuple[Measurements, BayesianFit]:
    """Return the measurements before the service, and the calibration by them."""
    known = measured(scenario, sensor)
    return known, bayesian_fit(known, sensor_type, max(known.days), DEFAULT_RANGES)


def by_hardware(core: CoreDesign, wheels: Sequence[Wheel]) -> list[Values]:
    """Return the readings of each wheel by the integers of the hardware in mm, all days of all wheels at once."""
    sets = [one for wheel in wheels for one in wheel.sets]
    results = compute_stacked(sets, np.concatenate([wheel.codes for wheel in wheels], axis=1))
    read = core.datapath.output.decode(results[-KEPT:]).mean(axis=0)
    return np.split(read, len(wheels))


def _loaded(core: CoreDesign, polynomial: Polynomial, before: Datapath) -> tuple[Datapath, bool]:
    """Return the datapath with a polynomial, or that of before and True if the hardware refuses it."""
    try:
        swap = check_swap(core, None, other_set(core, polynomial=polynomial, max_error=SET_ERROR))
    except ShortfallError:
        return before, True
    return swap.new_set.quantized.datapath, False


def _read(
    scenario: ScenarioFile, core: CoreDesign, state: Any, clearance: float, chance: Any, day: int
) -> tuple[Values, Values, Any]:
    """Return voltages in V, temperatures in degC and codes of a reading at one clearance."""
    temperature = float(chance(f"temperature of day {day}").uniform(20.0, 60.0))
    time = np.arange(SAMPLES) / float(core.spec.sample_rate)
    one = np.ones(SAMPLES)
    codes = scenario.sensors.codes(
        clearance * one,
        temperature * one,
        time,
        core.datapath.inputs,
        streams(int(chance("seed").integers(1 << 30)) + day, "reading"),
        state=state,
    )
    V, T = (port.decode(codes[:, k]) for k, port in enumerate(core.datapath.inputs))
    return V, T, codes


def _uncertainty(
    posterior: Posterior, polynomial: Polynomial, V: Values, T: Values, noise: float
) -> tuple[float, float]:
    """Return the standard uncertainty in mm of a reading that is new on its day, and that which the days share.

    The sensor's deviations are the same on all days; the error of the day is new, as far as its targets leave it open,
    and so are what the polynomial misses of the day's curve and the noise of the reading, in V. How large an error of
    a day is, ten days do not say for certain: what is new is that of the normal distribution with the same interval.
    """
    mean, of_curve, of_day = posterior.predicted_parts(V, T)
    off = mean - polynomial(V, T)[:, None]
    deviations = len(posterior.mean)
    shared = np.sum(of_curve[:deviations] ** 2, axis=0)
    by_voltage, _ = slopes(polynomial, V, T)
    new = np.sum(of_curve[deviations:] ** 2, axis=0) + of_day + off**2 + (noise * float(by_voltage[0])) ** 2
    half = mixture_half_width(np.zeros_like(new), new, posterior.scatters.of_intervals, SHARE)
    return float(half[0]) / NORMAL, float(np.sqrt(posterior.scatters.variance_of(shared)[0]))


def reading_noise(core: CoreDesign, noise: float) -> float:
    """Return the standard deviation in V of the mean of the last samples of a reading, of white noise in V."""
    ideal = core.quantized.filter
    assert ideal is not None, "the instrument has a filter"
    length = 4 * SAMPLES
    response = sosfilt(ideal.sos, np.eye(1, length)[0])
    total = np.convolve(response, np.full(KEPT, 1.0 / KEPT))
    return noise * float(np.sqrt(np.sum(total**2)))


WAYS = ("readings", "filter", "sum", "filter and sum")


def judged(wheels: Sequence[Wheel], read: Values, seed: int) -> dict[str, dict[str, float]]:
    """Return accuracy in %, rms in mm and the share of intervals that hold, of each way to use readings (2, days)."""
    true = np.array([wheel.true for wheel in wheels])
    spread = np.array([wheel.uncertainty for wheel in wheels])
    shared = np.array([wheel.shared for wheel in wheels])
    total = true.sum(axis=0) + streams(seed, "service")("sum").normal(0.0, SUM_KNOWN_TO, DAYS)
    whole = np.hypot(spread, shared)
    found = {"readings": _of(read, true, np.abs(read - true) <= NORMAL * whole)}
    share = whole**2 / ((whole**2).sum(axis=0) + SUM_KNOWN_TO**2)
    summed = read + share * (total - read.sum(axis=0))
    found["sum"] = _of(summed, true, np.abs(summed - true) <= NORMAL * whole * np.sqrt(1 - share))
    # The filter takes all days to share alike, the mean; what a day has more or less than that is new to it.
    alike = float(np.mean(shared))
    spread = np.hypot(spread, shared - alike)
    model = WearModel(shared=alike)
    for name, known in (("filter", None), ("filter and sum", total)):
        days = [
            DayReading(
                time=float(k),
                clearance=tuple(read[:, k].tolist()),
                uncertainty=tuple(spread[:, k].tolist()),
                total=None if known is None else float(known[k]),
                total_uncertainty=SUM_KNOWN_TO,
            )
            for k in range(DAYS)
        ]
        states = filtered(days, model)
        levels = np.array([[state.level(w)[0] for state in states] for w in range(2)])
        found[name] = _of(
            levels, true, np.array([[_holds(s, true[w, k], w) for k, s in enumerate(states)] for w in range(2)])
        )
    return found


def _holds(state: DayState, clearance: float, wheel: int) -> bool:
    low, high = state.interval(SHARE, wheel)
    return low <= clearance <= high


def _of(values: Values, true: Values, inside: Any) -> dict[str, float]:
    off = values - true
    return {
        "accuracy": round(100.0 - 100.0 * float(np.mean(np.abs(off) / true)), 4),
        "rms": round(float(np.sqrt(np.mean(off**2))), 5),
        "inside": round(float(np.mean(inside)), 4),
    }


def one_service(scenario: ScenarioFile, core: CoreDesign, seed: int) -> list[dict[str, Any]]:
    """Return the figures of one axle, by targets, by arithmetic and by way."""
    rows, true = [], true_clearances(seed)
    each = [
        [in_service(scenario, core, seed, w, true[w], targets=targets) for w in range(2)] for targets in (False, True)
    ]
    hardware = by_hardware(core, [wheel for wheels in each for wheel in wheels])
    for targets, wheels in enumerate(each):
        refused = sum(wheel.refused for wheel in wheels)
        readings = {
            "double": np.array([wheel.double for wheel in wheels]),
            "hardware": np.array(hardware[2 * targets : 2 * targets + 2]),
        }
        for by, read in readings.items():
            for way, one in judged(wheels, read, seed).items():
                rows.append({"seed": seed, "targets": bool(targets), "by": by, "way": way, "refused": refused} | one)
    return rows


def without_drift(scenario: ScenarioFile, core: CoreDesign, seed: int) -> list[dict[str, Any]]:
    """Return the figures of one axle without targets by a type that does not drift, as the bench's sensors do not."""
    true, still = true_clearances(seed), replace(TYPE, offset_drift=0.0, gain_drift=0.0)
    wheels = [in_service(scenario, core, seed, w, true[w], targets=False, sensor_type=still) for w in range(2)]
    read = np.array([wheel.double for wheel in wheels])
    return [{"seed": seed, "targets": False, "way": way} | one for way, one in judged(wheels, read, seed).items()]
