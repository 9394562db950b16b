"""The paper's bench with reference targets on the morning of the run: a part of `python -m benchmarks.days`.

For each seed the depot measures on the ten days before; in the morning some targets are read, each off its nominal
clearance by its own uncertainty; the calibration is fitted to all of it, loaded into hardware that exists, with the
proof, and the run is evaluated with it, in double precision and in the integers of the hardware.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from examples.wear_campaign import hardware
from examples.wear_campaign.bench import PAPER_FILTER
from examples.wear_campaign.methods import PRIOR, measured, on_day

from sosmith.gen.calibration.fit import Measurements
from sosmith.gen.core import CoreDesign
from sosmith.gen.reload.reload import check_swap, other_set
from sosmith.gen.stimuli.core import bench_of
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES
from sosmith.instrument.calibration.bayesian_fit import BayesianFit, bayesian_fit
from sosmith.instrument.calibration.mixed_effects.day_polynomial import polynomial_of
from sosmith.instrument.calibration.mixed_effects.following_day import Following
from sosmith.instrument.calibration.uncertainty import reading_half_width
from sosmith.instrument.scenarios.file import ScenarioFile, emulate_file
from sosmith.instrument.sensors.inductive_sensor import InductiveState
from sosmith.instrument.uncertainty.instrument_budget import noise_gain, slopes
from sosmith.model.arithmetic.random_streams import streams
from sosmith.model.arrays import Values
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.stacked import compute_stacked
from sosmith.model.errors import ShortfallError
from sosmith.model.reference.accuracy import accuracy_percent
from sosmith.model.reference.golden import filtered
from sosmith.model.traces.trace import Trace

SCENARIOS = Path(__file__).parents[1] / "examples" / "scenarios"
RUNS = ("bench_43_50", "bench_92_96")

TARGETS: dict[str, tuple[float, ...]] = {
    "none": (),
    "three": (1.5, 3.5, 7.0),
    "five": (1.5, 3.0, 5.0, 7.0, 9.0),
}
"""Clearances in mm of the targets. The lowest is beyond the sensor's rail at the depot's temperature, which is at
1.1 mm without an error of the day; the lower half is read more densely, since the paper's accuracy is relative."""

KNOWN_TO = 0.02
"""Standard uncertainty of a target in mm."""

MORNING = 20.0
"""Temperature in degC at which targets are read: that of the depot, not that of the run."""

ORDER = 6
"""Highest order in the voltage that the hardware has room for."""

TYPE = replace(PRIOR, order=ORDER)

RATE = 6.0
"""Sample rate in Hz, the paper's section 4."""

UNCERTAINTY = {"noise": 0.048, "temperature": 0.3, "voltage": 0.0, "clearance_rate": 0.0}
"""What is stated of the instrument, as in examples/wear_campaign/campaign.toml."""

MAX_ERROR, SET_ERROR = 0.0005, Fraction(1, 1000)
"""Allowed error in mm of the hardware as it is made, and with a set that is loaded."""

HELD_DAYS = {"none": 12, "three": 4, "five": 4}
"""Days that a figure is the mean of: that of the run and those after it, each with the targets of its own morning. All
readings of a day share its error, so that one day says little about how often intervals hold, and as little about how
far readings are off. The sensors of the bench do not age; what the calibration allows for their ageing counts all the
same."""

AT_RAIL = 0.01
"""Share of a reading from which on samples at the rail spoil it: the hardware flags those (`input_at_rail`), and no
interval is claimed. It counts for the accuracy all the same."""

FACTORY_SEED = 8999
"""Of the sensor whose day the hardware is made with: its own curve is of the highest order."""


def with_targets(
    known: Measurements,
    scenario: ScenarioFile,
    state: InductiveState,
    date: int,
    clearances: tuple[float, ...],
    seed: int,
) -> Measurements:
    """Return measurements with the readings of targets on the day `date`, when the sensor is in `state`."""
    if not clearances:
        return known
    nominal = np.array(clearances)
    true = nominal + streams(seed, "targets")(f"day {date}").normal(0.0, KNOWN_TO, len(nominal))
    temperature = np.full(len(nominal), MORNING)
    voltage = scenario.sensors.inductive.steady_voltage(true, temperature, state)
    before = np.zeros((3, len(known))) if known.uncertainty is None else known.uncertainty
    own = np.zeros((3, len(nominal)))
    own[0] = KNOWN_TO
    return Measurements(
        np.concatenate((known.clearance, nominal)),
        np.concatenate((known.voltage, voltage)),
        np.concatenate((known.temperature, scenario.sensors.thermometer.steady(temperature))),
        known.source,
        (*known.days, *[date] * len(nominal)),
        np.concatenate((before, own), axis=1),
    )


def calibrated(scenario: ScenarioFile, seed: int, clearances: tuple[float, ...]) -> tuple[Measurements, BayesianFit]:
    """Return the measurements of the days before with those of the morning, and the calibration for the run."""
    (excerpt,) = scenario.document.excerpt
    date = scenario.document.start.toordinal() + int(excerpt.day)
    state = scenario.sensors.inductive.state(excerpt.day, streams(seed, "life of the sensor"))
    every = with_targets(measured(scenario, seed), scenario, state, date, clearances, seed)
    return every, bayesian_fit(every, TYPE, date, DEFAULT_RANGES)


def hardware_of(scenario: ScenarioFile, folder: Path) -> CoreDesign:
    """Design hardware with room for the highest order, to which calibrations are loaded."""
    _, made = calibrated(scenario, FACTORY_SEED, TARGETS["five"])
    table = hardware.calibration_table(made.fit.polynomial)
    stated = hardware.uncertainty_table(UNCERTAINTY)
    return hardware.instrument(
        folder, "day", RATE, table, PAPER_FILTER, reload=True, max_error=MAX_ERROR, uncertainty=stated
    )


@dataclass(frozen=True, eq=False)
class Day:
    """A day's readings, with its calibration and the hardware's datapath with that; None if the set was refused."""

    trace: Trace
    made: BayesianFit
    datapath: Datapath | None
    bound: float | None


@dataclass(frozen=True, eq=False)
class Held:
    """Readings of one day, shape (n,): their errors in mm, half-widths of intervals, and where these are claimed.

    `by_hardware` are the errors of the hardware's integers; None if the set was refused.
    """

    off: Values
    half: Values
    claimed: Values
    by_hardware: Values | None

    def inside(self, off: Values) -> float:
        """Return the share of the claimed intervals that hold; NaN if there are none."""
        return float(np.mean((np.abs(off) <= self.half)[self.claimed])) if self.claimed.any() else float("nan")


def held(core: CoreDesign, day: Day, codes: Values | None) -> Held:
    """Hold readings against their intervals, in double precision and by the integers of the hardware (`codes`).

    The interval of a reading is that of the calibration at its voltage and temperature, with the noise that the filter
    lets through and what is stated of the thermometer.
    """
    trace, polynomial, bench = day.trace, day.made.fit.polynomial, bench_of(core)
    sos, steady = core.quantized.filter.sos, core.quantized.steady
    V, T = (port.decode(trace.codes[:, k]) for k, port in enumerate(bench.ports))
    clearance = filtered(polynomial(V, T), sos, bench.output, steady=steady)
    voltage, at = core.datapath.inputs[0], trace.reading
    at_rail = np.isin(trace.codes[:, 0], (voltage.lowest, voltage.highest)).astype(np.float64)
    spoilt = np.abs(filtered(at_rail, sos, bench.output, steady=steady)) > AT_RAIL
    V, T = V[at], T[at]
    by_voltage, by_temperature = slopes(polynomial, V, T)
    noise = UNCERTAINTY["noise"] * noise_gain(core.quantized.filter)
    beside = (noise * by_voltage) ** 2 + (UNCERTAINTY["temperature"] * by_temperature) ** 2
    half = reading_half_width(day.made, V, T, beside)
    by_hardware = None if codes is None else (core.datapath.output.decode(codes) - trace.truth)[at]
    return Held((clearance - trace.truth)[at], half, ~spoilt[at], by_hardware)


def days_of(scenario: ScenarioFile, core: CoreDesign, seed: int, name: str) -> Iterator[Day]:
    """Yield the day of the run and those after it, each calibrated; a set that stays is proven once."""
    (excerpt,) = scenario.document.excerpt
    known, made = calibrated(scenario, seed, TARGETS[name])
    day = Day(emulate_file(scenario, bench_of(core), seed=seed), made, *loaded(core, made))
    yield day
    before = before_targets(made)
    for k in range(1, HELD_DAYS[name]):
        here = on_day(scenario, excerpt.day + k)
        date = here.document.start.toordinal() + int(excerpt.day) + k
        trace = emulate_file(here, bench_of(core), seed=seed)
        if TARGETS[name]:
            made = followed(here, made, known, before, date, TARGETS[name], seed)
            day = Day(trace, made, *loaded(core, made))
        else:
            day = replace(day, trace=trace, made=for_day(made, date))
        yield day


def before_targets(made: BayesianFit) -> Following:
    """Return where the sensor's deviations stood on the last day of measurements, whose own curve is left out."""
    last, days = made.model.course(made.posterior.scatters), made.model.rows.days
    posterior = replace(
        made.posterior, mean=last.mean[-1], factor=last.factor[-1], offset=None, slope=None, curve_factor=None
    )
    return Following(posterior, days[-1])


def followed(
    scenario: ScenarioFile,
    made: BayesianFit,
    known: Measurements,
    before: Following,
    date: int,
    clearances: tuple[float, ...],
    seed: int,
) -> BayesianFit:
    """Return the calibration for a later day with the targets of its morning, by those of the first day and before."""
    (excerpt,) = scenario.document.excerpt
    state = scenario.sensors.inductive.state(excerpt.day, streams(seed, "life of the sensor"))
    empty = Measurements(*(np.zeros(0) for _ in range(3)), "targets", ())
    morning = with_targets(empty, scenario, state, date, clearances, seed)
    posterior = before.on(morning, np.ones(len(morning)), date).posterior
    polynomial, plain = polynomial_of(posterior, known, made.region, DEFAULT_RANGES)
    return replace(made, posterior=posterior, plain=plain, step=None, fit=replace(made.fit, polynomial=polynomial))


def one_run(scenario: ScenarioFile, core: CoreDesign, seed: int) -> Iterator[dict[str, Any]]:
    """Yield the figures of one run for each number of targets; intervals are held against the days after it, too."""
    every = [(name, day) for name in TARGETS for day in days_of(scenario, core, seed, name)]
    taken = [day for _, day in every if day.datapath is not None]
    sets = [day.datapath for day in taken if day.datapath is not None]
    results = compute_stacked(sets, np.stack([day.trace.codes for day in taken], axis=1))
    codes = {id(day): results[:, k] for k, day in enumerate(taken)}
    for name in TARGETS:
        days = [day for own, day in every if own == name]
        found = [held(core, day, codes.get(id(day))) for day in days]
        row: dict[str, Any] = {"run": scenario.path.stem, "targets": name, "seed": seed}
        row |= {"order": days[0].made.fit.polynomial.orders[0], "days": len(days)}
        row |= {"refused": sum(day.datapath is None for day in days)}
        row |= {"bound": max((day.bound for day in days if day.bound is not None), default=None)}
        each = [figures(day, one) for day, one in zip(days, found, strict=True)]
        row |= {"off": round(max((one["off"] for one in each if one["off"] is not None), default=0.0), 4)}
        for key, shares in (
            *((name, [one[name] for one in each if one[name] is not None]) for name in ("accuracy", "hardware", "rms")),
            ("inside", [one.inside(one.off) for one in found]),
            ("inside_hardware", [one.inside(one.by_hardware) for one in found if one.by_hardware is not None]),
            ("half_width", [float(one.half[one.claimed].mean()) for one in found if one.claimed.any()]),
            ("claimed", [float(one.claimed.mean()) for one in found]),
        ):
            row[key] = round(float(np.nanmean(shares)), 4)
        yield row


def for_day(made: BayesianFit, date: int) -> BayesianFit:
    """Return a calibration for a later day without measurements: the same curve, as far as it may have drifted."""
    posterior = made.posterior
    return replace(made, posterior=made.model.posterior(posterior.scatters, posterior.curves, date))


def figures(day: Day, held_day: Held) -> dict[str, Any]:
    """Return accuracy in %, in double precision and by the hardware, how far both are apart, and rms in mm of a day."""
    trace, clearance = day.trace, day.trace.truth.copy()
    row: dict[str, Any] = {"rms": float(np.sqrt(np.mean(held_day.off**2))), "hardware": None, "off": None}
    for name, off in (("accuracy", held_day.off), ("hardware", held_day.by_hardware)):
        if off is not None:
            clearance[trace.reading] = trace.truth[trace.reading] + off
            row[name] = accuracy_percent(clearance, trace.truth, trace.reading)
    if row["hardware"] is not None:
        row["off"] = abs(row["hardware"] - row["accuracy"])
    return row


def loaded(core: CoreDesign, made: BayesianFit) -> tuple[Datapath | None, float | None]:
    """Load a calibration into the hardware: its datapath and proven bound in mm; None if it is refused."""
    try:
        swap = check_swap(core, None, other_set(core, polynomial=made.fit.polynomial, max_error=SET_ERROR))
    except ShortfallError:
        return None, None
    quantized = swap.new_set.quantized
    return quantized.datapath, round(float(quantized.bound * quantized.datapath.output.lsb), 7)
