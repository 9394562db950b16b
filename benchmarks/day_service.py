"""26 days of service of an axle, with and without targets, filter and known sum: a part of `python -m benchmarks.days`.

Both wheels wear by 0.05 mm a day, and by 0.45 mm more on one day of bad track; each has a sensor of its own, calibrated
on the ten days before the service, whose day errs as on the paper's bench. Each day gives one reading of each wheel, in
double precision and by the integers of the hardware with the curve of the day.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.day_bench import SCENARIOS, SET_ERROR, TYPE, hardware_of, with_targets
from examples.wear_campaign.methods import measured
from scipy.signal import sosfilt

from sosmith.gen.calibration.fit import Measurements
from sosmith.gen.core import CoreDesign
from sosmith.gen.reload.reload import check_swap, other_set
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES
from sosmith.instrument.calibration.bayesian_fit import bayesian_fit
from sosmith.instrument.calibration.mixed_effects.day_polynomial import polynomial_of
from sosmith.instrument.calibration.mixed_effects.following_day import Following
from sosmith.instrument.calibration.mixed_effects.model import Posterior
from sosmith.instrument.scenarios.file import ScenarioFile, load_scenario
from sosmith.instrument.uncertainty.instrument_budget import slopes
from sosmith.instrument.wear.state_space import DayReading, DayState, WearModel, filtered
from sosmith.model.arithmetic.random_streams import streams
from sosmith.model.arrays import Values
from sosmith.model.dataflow.datapath import Datapath
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

SHARE = 0.95

THROUGH_HARDWARE = 10
"""Axles whose readings are computed by the integers of the hardware, too: each set is proven and compiled."""


@dataclass(frozen=True, eq=False)
class Wheel:
    """One wheel in service: true clearance, readings and their uncertainty on each day, shape (days,), in mm."""

    true: Values
    double: Values
    hardware: Values | None
    uncertainty: Values
    shared: float
    refused: int


def true_clearances(seed: int) -> Values:
    """Return the clearances of both wheels over the days; shape (2, days)."""
    day = int(streams(seed, "service")("bad track").integers(5, DAYS - 6))
    worn = RATE * np.arange(DAYS) + JUMP * (np.arange(DAYS) >= day)
    return np.array(FIRST)[:, None] + worn


def in_service(
    scenario: ScenarioFile, core: CoreDesign, seed: int, wheel: int, true: Values, *, targets: bool, loaded: bool
) -> Wheel:
    """Read one wheel over the days; with `targets`, two gauges of whole millimetres about it are read each morning."""
    sensor = 2 * seed + wheel
    known = measured(scenario, sensor)
    first = scenario.document.start.toordinal()
    made = bayesian_fit(known, TYPE, max(known.days), DEFAULT_RANGES)
    last = made.model.course(made.posterior.scatters)
    before = replace(
        made.posterior, mean=last.mean[-1], factor=last.factor[-1], offset=None, slope=None, curve_factor=None
    )
    so_far = Following(before, max(known.days))
    chance = streams(sensor, "service of a wheel")
    found: dict[str, list[float]] = {"double": [], "hardware": [], "uncertainty": []}
    polynomial: Polynomial | None = None
    shared: list[float] = []
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
            if loaded:
                datapath, refusal = _loaded(core, polynomial, datapath)
                refused += refusal
        V, T, codes = _read(scenario, core, state, clearance, chance, k)
        values = smooth(polynomial(V, T), core.quantized.filter.sos, core.datapath.output, steady=core.quantized.steady)
        expected = float(np.mean(values[-KEPT:]))
        found["double"].append(expected)
        if loaded:
            found["hardware"].append(float(np.mean(datapath.output.decode(datapath.compute(codes))[-KEPT:])))
        new, common = _uncertainty(so_far.posterior, polynomial, V[-1:], T[-1:], noise)
        found["uncertainty"].append(new)
        shared.append(common)
    columns = {name: np.array(values) if values else None for name, values in found.items()}
    return Wheel(true=true, shared=float(np.mean(shared)), refused=refused, **columns)


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
    and so are what the polynomial misses of the day's curve and the noise of the reading, in V.
    """
    mean, of_curve, of_day = posterior.predicted_parts(V, T)
    off = mean - polynomial(V, T)[:, None]
    deviations = len(posterior.mean)
    shared = np.sum(of_curve[:deviations] ** 2, axis=0)
    new = np.sum(of_curve[deviations:] ** 2, axis=0) + of_day + off**2
    weigh = posterior.scatters.variance_of
    by_voltage, _ = slopes(polynomial, V, T)
    whole = float(weigh(new)[0]) + (noise * float(by_voltage[0])) ** 2
    return float(np.sqrt(whole)), float(np.sqrt(weigh(shared)[0]))


def reading_noise(core: CoreDesign, noise: float) -> float:
    """Return the standard deviation in V of the mean of the last samples of a reading, of white noise in V."""
    ideal = core.quantized.filter
    assert ideal is not None, "the instrument has a filter"
    length = 4 * SAMPLES
    response = sosfilt(ideal.sos, np.eye(1, length)[0])
    total = np.convolve(response, np.full(KEPT, 1.0 / KEPT))
    return noise * float(np.sqrt(np.sum(total**2)))


WAYS = ("readings", "filter", "sum", "filter and sum")


def judged(wheels: tuple[Wheel, Wheel], seed: int, column: str) -> dict[str, dict[str, float]]:
    """Return accuracy in %, rms in mm and the share of intervals that hold, of each way to use the readings."""
    true = np.array([wheel.true for wheel in wheels])
    read = np.array([getattr(wheel, column) for wheel in wheels])
    spread = np.array([wheel.uncertainty for wheel in wheels])
    shared = np.array([[wheel.shared] for wheel in wheels])
    total = true.sum(axis=0) + streams(seed, "service")("sum").normal(0.0, SUM_KNOWN_TO, DAYS)
    whole = np.hypot(spread, shared)
    z = 1.959964
    found = {"readings": _of(read, true, np.abs(read - true) <= z * whole)}
    share = whole**2 / ((whole**2).sum(axis=0) + SUM_KNOWN_TO**2)
    summed = read + share * (total - read.sum(axis=0))
    found["sum"] = _of(summed, true, np.abs(summed - true) <= z * whole * np.sqrt(1 - share))
    model = WearModel(shared=float(np.mean(shared)))
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


def one_service(scenario: ScenarioFile, core: CoreDesign, seed: int, *, loaded: bool) -> list[dict[str, Any]]:
    """Return the figures of one axle, by targets, by arithmetic and by way."""
    rows = []
    for targets in (False, True):
        true = true_clearances(seed)
        wheels = tuple(in_service(scenario, core, seed, w, true[w], targets=targets, loaded=loaded) for w in range(2))
        refused = sum(wheel.refused for wheel in wheels)
        for column in ("double", "hardware") if loaded else ("double",):
            for way, one in judged((wheels[0], wheels[1]), seed, column).items():
                rows.append({"seed": seed, "targets": targets, "by": column, "way": way, "refused": refused} | one)
    return rows


def all_services(seeds: range, folder: Path, progress: Callable[[str, int, int], None]) -> list[dict[str, Any]]:
    """Return the figures of all axles."""
    scenario = load_scenario(SCENARIOS / f"{SCENARIO}.toml")
    core, rows = hardware_of(scenario, folder / "service"), []
    for k, seed in enumerate(seeds):
        progress("service", k, len(seeds))
        rows += one_service(scenario, core, seed, loaded=k < THROUGH_HARDWARE)
    return rows
