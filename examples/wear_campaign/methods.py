"""Ways of fitting side by side: three true sensors, on the bench and over a week in service, for every seed."""

from __future__ import annotations

import datetime
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from examples.wear_campaign import hardware
from examples.wear_campaign.bench import PAPER_FILTER
from examples.wear_campaign.ceilings import Curve, ceilings
from examples.wear_campaign.spread import spread

from sosmith.gen.calibration.fit import COLUMNS, Measurements, fit
from sosmith.gen.calibration.least_squares import Sums
from sosmith.gen.core import CoreDesign
from sosmith.gen.stimuli.core import bench_of
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES
from sosmith.instrument.calibration.bayesian_fit import bayesian_fit
from sosmith.instrument.calibration.coefficient_covariance import CoefficientUncertainty, of_bayes, of_least_squares
from sosmith.instrument.calibration.sensor_type import SENSOR_TYPES, TERMS
from sosmith.instrument.calibration.uncertainty import Interval, of_polynomial, of_posterior
from sosmith.instrument.scenarios.depot_measurements import measurements_of
from sosmith.instrument.scenarios.file import ScenarioFile, emulate_file
from sosmith.instrument.sensors.inductive_sensor import FORWARD_MODELS
from sosmith.instrument.uncertainty.instrument_budget import Instrument
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import EQUATION_5A, Polynomial
from sosmith.model.reference.accuracy import accuracy_percent
from sosmith.model.reference.golden import filtered
from sosmith.model.traces.trace import Trace
from sosmith.sim.simulation import Progress

Values = npt.NDArray[np.float64]

HELD = 200
"""About so many readings of a run, or of a day, are held against their intervals."""

PART = "source: "
"""Begins the names of the figures of the budget's parts."""

DIGITS = 4
"""Decimals of the recorded figures."""

RATE = 100.0
"""Sample rate of the week in Hz."""

PRIOR = SENSOR_TYPES["equation_5a"]
"""What is known of the sensor beforehand, whichever sensor it really is."""


@dataclass(frozen=True, eq=False)
class Worth:
    """What a calibration says of itself.

    Attributes
    ----------
    known : CoefficientUncertainty
        What the budget makes its intervals of.
    interval : Interval
        Half-width in mm of the 95 % intervals of the calibration alone.
    """

    known: CoefficientUncertainty
    interval: Interval


@dataclass(frozen=True, eq=False)
class Made:
    """A calibration: its curve, the order in the voltage, and what it is worth, if it says so."""

    curve: Curve
    order: int
    worth: Worth | None = None
    plain: bool = True


BEFORE = Made(EQUATION_5A, 2)
"""What the hardware has before the first fit."""


def by_the_rule(measurements: Measurements, date: int) -> Made:
    """Fit by the paper's rule."""
    made = fit(measurements)
    worth = Worth(of_least_squares(measurements, made), of_polynomial(measurements, made).half_width)
    return Made(made.polynomial, made.orders[0], worth)


def by_least_squares(measurements: Measurements, date: int) -> Made:
    """Fit the paper's orders (2, 1), whatever r is reached."""
    solution = Sums(measurements.clearance, measurements.voltage, measurements.temperature).solve(TERMS)
    assert solution is not None, "the depot measures at enough voltages and temperatures"
    return Made(solution.polynomial, 2)


def by_bayes(measurements: Measurements, date: int) -> Made:
    """Fit the mixed-effects model for the day."""
    made = bayesian_fit(measurements, PRIOR, date, DEFAULT_RANGES)
    worth = Worth(of_bayes(measurements, made), of_posterior(measurements, made).half_width)
    return Made(made.fit.polynomial, made.fit.orders[0], worth, made.plain)


METHODS: dict[str, Callable[[Measurements, int], Made]] = {
    "paper": by_the_rule,
    "least squares": by_least_squares,
    "bayes": by_bayes,
}
"""Ways of fitting by name."""


def with_sensor(scenario: ScenarioFile, name: str) -> ScenarioFile:
    """Return the scenario with another true sensor."""
    inductive = replace(scenario.sensors.inductive, model=FORWARD_MODELS[name])
    return replace(scenario, sensors=replace(scenario.sensors, inductive=inductive))


def with_calibration(scenario: ScenarioFile, **changes: Any) -> ScenarioFile:
    """Return the scenario with other measurements in the depot."""
    assert scenario.document.calibration is not None, "the scenario has measurements"
    table = scenario.document.calibration.model_copy(update=changes)
    return replace(scenario, document=scenario.document.model_copy(update={"calibration": table}))


def measured(scenario: ScenarioFile, seed: int, outliers: float = 0.0) -> Measurements:
    """Return the depot's measurements; a share `outliers` of them are off by 3 mm, up or down."""
    rows = measurements_of(scenario, seed)
    d, V, T = (np.array([getattr(row, name) for row in rows]) for name in COLUMNS)
    if outliers:
        generator = np.random.default_rng([seed, 3])
        wrong = generator.random(len(d)) < outliers
        d = np.maximum(d + np.where(wrong, generator.choice([-3.0, 3.0], len(d)), 0.0), 0.0)
    days = tuple(datetime.date.fromisoformat(row.date).toordinal() for row in rows)
    return Measurements(d, V, T, "the depot", days)


def until(measurements: Measurements, date: int) -> Measurements:
    """Return the measurements up to a day."""
    m, kept = measurements, np.array(measurements.days) <= date
    days = tuple(np.array(m.days)[kept].tolist())
    return Measurements(m.clearance[kept], m.voltage[kept], m.temperature[kept], m.source, days)


def judged(made: Made, trace: Trace, core: CoreDesign, others: Sequence[Trace] = ()) -> dict[str, float]:
    """Return the accuracy in per cent; of the intervals the share that hold the true clearance, and half-widths in mm.

    The intervals are held against the trace and `others`; their figures are means over all of these. They are those of
    the whole budget and, as ``calibration ...``, those of the calibration alone; with the standard uncertainty in mm
    that each source of the budget has on average, as ``PART`` and its name.
    """
    quantized, reading = core.quantized, trace.reading
    _, _, clearance = measured_by(made, trace, core)
    found = {
        "accuracy": accuracy_percent(clearance, trace.truth, reading),
        "order": float(made.order),
        "plain": float(made.plain),
    }
    if made.worth is None:
        return found
    assert isinstance(made.curve, Polynomial), "what says its worth is a polynomial"
    instrument = Instrument(
        spec=core.spec,
        polynomial=made.curve,
        known=made.worth.known,
        ideal=quantized.filter,
        bound=float(core.spec.max_error),
    )
    held: dict[str, list[float]] = {}
    for one in (trace, *others):
        V, T, clearance = measured_by(made, one, core)
        some = np.flatnonzero(one.reading)
        some = some[:: max(len(some) // HELD, 1)]
        off, V, T = np.abs(clearance - one.truth)[some], V[some], T[some]
        budget = instrument.budget(V, T)
        for name, half in (("", budget.expanded), ("calibration ", made.worth.interval(V, T))):
            held.setdefault(f"{name}inside", []).append(float(np.mean(off <= half)))
            held.setdefault(f"{name}half_width", []).append(float(half.mean()))
        for source in budget.contributions:
            held.setdefault(f"{PART}{source.source}", []).append(float(source.contribution.mean()))
    return found | {figure: float(np.mean(values)) for figure, values in held.items()}


def measured_by(made: Made, trace: Trace, core: CoreDesign) -> tuple[Values, Values, Values]:
    """Return voltage in V, temperature in degC and filtered clearance in mm of a trace."""
    bench = bench_of(core)
    V, T = (port.decode(trace.codes[:, k]) for k, port in enumerate(bench.ports))
    steady = core.quantized.steady
    return V, T, filtered(made.curve(V, T), core.quantized.filter.sos, bench.output, steady=steady)


def on_day(scenario: ScenarioFile, day: float) -> ScenarioFile:
    """Return a scenario of one excerpt with the run on another day."""
    (excerpt,) = scenario.document.excerpt
    moved = (excerpt.model_copy(update={"day": day}),)
    return replace(scenario, document=scenario.document.model_copy(update={"excerpt": moved}))


def on_the_bench(
    scenario: ScenarioFile, core: CoreDesign, seed: int, days: int = 1
) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield each method's figures for one run.

    Intervals are held against `days` runs: on the day of the run, and on as many of the days after it instead. The
    sensors of the bench do not age, so that these days differ by their systematic errors and noise only.
    """
    (excerpt,) = scenario.document.excerpt
    date = scenario.document.start.toordinal() + int(excerpt.day)
    rows, trace = measured(scenario, seed), emulate_file(scenario, bench_of(core), seed=seed)
    later = [emulate_file(on_day(scenario, excerpt.day + k), bench_of(core), seed=seed) for k in range(1, days)]
    for name, method in METHODS.items():
        yield name, judged(method(rows, date), trace, core, later)
    for name, curve in ceilings(scenario, trace, seed).items():
        yield name, judged(Made(curve, 2), trace, core)


def in_the_week(
    scenario: ScenarioFile, core: CoreDesign, seed: int, outliers: float = 0.0
) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield each method's figures for one week, the mean over its days."""
    rows, trace = measured(scenario, seed, outliers), emulate_file(scenario, bench_of(core), seed=seed)
    excerpts = scenario.document.excerpt
    lengths = [round((excerpt.seconds or 0) * RATE) for excerpt in excerpts]
    day_of = np.repeat([int(excerpt.day) for excerpt in excerpts], lengths)
    for name, method in METHODS.items():
        days = []
        for day in sorted(set(day_of.tolist())):
            span = slice(*np.flatnonzero(day_of == day)[[0, -1]] + [0, 1])
            part = replace(trace, codes=trace.codes[span], truth=trace.truth[span], reading=trace.reading[span])
            date = scenario.document.start.toordinal() + day
            try:
                made = method(until(rows, date), date)
            except SpecificationError:  # no polynomial is good enough: the calibration stays
                made = made if days else BEFORE
            days.append(judged(made, part, core))
        every = dict.fromkeys(figure for one in days for figure in one)
        yield name, {figure: float(np.mean([one[figure] for one in days if figure in one])) for figure in every}


@dataclass(frozen=True, eq=False)
class Case:
    """A scenario with a true sensor; `run` yields each method's figures for one of the seeds 1 to `seeds`."""

    name: str
    sensor: str
    seeds: int
    run: Callable[[int], Iterator[tuple[str, dict[str, float]]]]


def cases(settings: dict[str, Any], scenarios: dict[str, ScenarioFile], filter_table: str, folder: Path) -> list[Case]:
    """Return all cases; `scenarios` are those of the bench and that of the week, by name, the week's last."""
    calibration = hardware.calibration_table(EQUATION_5A)
    *bench_names, week_name = scenarios
    stated = [hardware.uncertainty_table(settings[name]["uncertainty"]) for name in ("bench", "week")]
    rate = settings["bench"]["sample_rate"]
    bench = hardware.instrument(folder, "bench", rate, calibration, PAPER_FILTER, uncertainty=stated[0])
    week = hardware.instrument(folder, "week", RATE, calibration, filter_table, uncertainty=stated[1])

    own, all_seeds = settings["methods"], settings["seeds"]
    some_seeds = min(all_seeds, own["variant_seeds"])

    def bench_case(
        name: str, sensor: str, scenario: ScenarioFile, seeds: int = all_seeds, days: int = own["interval_days"]
    ) -> Case:
        return Case(name, sensor, seeds, lambda seed: on_the_bench(with_sensor(scenario, sensor), bench, seed, days))

    def week_case(
        name: str, sensor: str, scenario: ScenarioFile, seeds: int = all_seeds, outliers: float = 0.0
    ) -> Case:
        return Case(name, sensor, seeds, lambda seed: in_the_week(with_sensor(scenario, sensor), week, seed, outliers))

    found = []
    for sensor in own["sensors"]:
        found += [bench_case(name, sensor, scenarios[name]) for name in bench_names]
        found.append(week_case(week_name, sensor, scenarios[week_name]))
    for sensor in own["sensors"]:
        for name in bench_names:
            table, (excerpt,) = scenarios[name].document.calibration, scenarios[name].document.excerpt
            assert table is not None, "the scenario has measurements"
            same_day = with_calibration(scenarios[name], days=(*table.days, excerpt.day))
            found.append(bench_case(f"{name}, same day", sensor, same_day, some_seeds, 1))
    first = own["sensors"][0]
    near = with_calibration(scenarios[week_name], clearances=tuple(own["near"]))
    found.append(week_case(f"{week_name}, near", first, near, some_seeds))
    found.append(week_case(f"{week_name}, outliers", first, scenarios[week_name], some_seeds, own["outliers"]))
    return found


def by_the_rule_alone(
    settings: dict[str, Any], scenarios: dict[str, ScenarioFile], folder: Path, progress: Progress
) -> list[dict[str, Any]]:
    """Return the accuracy and the order of the paper's rule on the bench, for as many seeds as its chances need."""
    own, calibration = settings["methods"], hardware.calibration_table(EQUATION_5A)
    core = hardware.instrument(folder, "bench", settings["bench"]["sample_rate"], calibration, PAPER_FILTER)
    rows = []
    for sensor in own["sensors"]:
        for name in settings["bench"]["scenarios"]:
            scenario = with_sensor(scenarios[name], sensor)
            row: dict[str, Any] = {"case": name, "sensor": sensor, "accuracy": [], "order": []}
            for seed in range(1, own["rule_seeds"] + 1):
                progress(f"the paper's rule: {name}, {sensor}", seed, own["rule_seeds"])
                made = fit(measured(scenario, seed))
                trace = emulate_file(scenario, bench_of(core), seed=seed)
                found = judged(Made(made.polynomial, made.orders[0]), trace, core)
                row["accuracy"].append(round(found["accuracy"], DIGITS))
                row["order"].append(made.orders[0])
            rows.append(row)
    return rows


def figures(case: Case, confidence: float, progress: Callable[[int], None]) -> dict[str, Any]:
    """Return the figures of each method in a case, for its seeds."""
    found: dict[str, dict[str, list[float]]] = {}
    for seed in range(1, case.seeds + 1):
        for method, one in case.run(seed):
            for figure, value in one.items():
                digits = DIGITS if not figure.startswith(PART) else 2 * DIGITS
                found.setdefault(method, {}).setdefault(figure, []).append(round(value, digits))
        progress(seed)
    accuracy = {method: spread(one["accuracy"], confidence) for method, one in found.items()}
    budget = {
        figure.removeprefix(PART): float(f"{np.mean(values):.{DIGITS}g}")
        for figure, values in found["bayes"].items()
        if figure.startswith(PART)
    }
    kept = {
        method: {figure: values for figure, values in one.items() if not figure.startswith(PART)}
        for method, one in found.items()
    }
    return {"case": case.name, "sensor": case.sensor, "methods": kept, "accuracy": accuracy, "budget": budget}


def side_by_side(
    settings: dict[str, Any], scenarios: dict[str, ScenarioFile], filter_table: str, folder: Path, progress: Progress
) -> list[dict[str, Any]]:
    """Return the figures of all cases."""
    rows: list[dict[str, Any]] = []
    every = cases(settings, scenarios, filter_table, folder)
    total, done = sum(case.seeds for case in every), 0
    for case in every:

        def step(seed: int, case: Case = case, done: int = done) -> None:
            progress(f"methods: {case.name}, {case.sensor}", done + seed, total)

        rows.append(figures(case, settings["confidence"], step))
        done += case.seeds
    return rows
