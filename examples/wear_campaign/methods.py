"""Ways of fitting side by side: three true sensors, on the bench and over a week in service, for every seed."""

from __future__ import annotations

import datetime
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from examples.wear_campaign import hardware
from examples.wear_campaign.bench import PAPER_FILTER
from examples.wear_campaign.spread import spread

from sosmith.gen.core import CoreDesign
from sosmith.gen.stimuli import bench_of
from sosmith.model.calibration.acceptance import DEFAULT_RANGES
from sosmith.model.calibration.bayesian_fit import bayesian_fit
from sosmith.model.calibration.fit import COLUMNS, Measurements, fit
from sosmith.model.calibration.least_squares import Sums
from sosmith.model.calibration.polynomial import EQUATION_5A, Polynomial
from sosmith.model.calibration.sensor_type import SENSOR_TYPES, TERMS
from sosmith.model.calibration.uncertainty import Interval, of_polynomial, of_posterior
from sosmith.model.errors import SpecificationError
from sosmith.model.reference.accuracy import accuracy_percent
from sosmith.model.reference.golden import filtered
from sosmith.model.scenarios.depot_measurements import measurements_of
from sosmith.model.scenarios.file import ScenarioFile, emulate_file
from sosmith.model.sensors.inductive_sensor import FORWARD_MODELS
from sosmith.model.traces.trace import Trace
from sosmith.sim.simulation import Progress

Values = npt.NDArray[np.float64]

EVERY = 10
"""One reading in so many is held against its interval."""

DIGITS = 4
"""Decimals of the recorded figures."""

RATE = 100.0
"""Sample rate of the week in Hz."""

PRIOR = SENSOR_TYPES["equation_5a"]
"""What is known of the sensor beforehand, whichever sensor it really is."""


@dataclass(frozen=True, eq=False)
class Made:
    """A calibration: its polynomial, and the half-width of its 95 % intervals in mm."""

    polynomial: Polynomial
    interval: Interval
    plain: bool = True


def by_the_rule(measurements: Measurements, date: int) -> Made:
    """Fit by the paper's rule."""
    made = fit(measurements)
    return Made(made.polynomial, of_polynomial(measurements, made).half_width)


def by_least_squares(measurements: Measurements, date: int) -> Made:
    """Fit the paper's orders (2, 1), whatever r is reached."""
    solution = Sums(measurements.clearance, measurements.voltage, measurements.temperature).solve(TERMS)
    assert solution is not None, "the depot measures at enough voltages and temperatures"
    polynomial = solution.polynomial
    return Made(polynomial, lambda V, T: np.zeros(len(V)))


def by_bayes(measurements: Measurements, date: int) -> Made:
    """Fit the mixed-effects model for the day."""
    made = bayesian_fit(measurements, PRIOR, date, DEFAULT_RANGES)
    return Made(made.fit.polynomial, of_posterior(measurements, made).half_width, made.plain)


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


def judged(made: Made, trace: Trace, core: CoreDesign) -> dict[str, float]:
    """Return accuracy in per cent, share of true clearances inside their intervals, mean half-width in mm."""
    bench = bench_of(core)
    V, T = (port.decode(trace.codes[:, k]) for k, port in enumerate(bench.ports))
    reading = trace.reading
    quantized = core.quantized
    clearance = filtered(made.polynomial(V, T), quantized.filter.sos, bench.output, steady=quantized.steady)
    some = np.flatnonzero(reading)[::EVERY]
    half = made.interval(V[some], T[some])
    return {
        "accuracy": accuracy_percent(clearance, trace.truth, reading),
        "inside": float(np.mean(np.abs(clearance - trace.truth)[some] <= half)),
        "half_width": float(half.mean()),
        "plain": float(made.plain),
    }


def on_the_bench(scenario: ScenarioFile, core: CoreDesign, seed: int) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield each method's figures for one run."""
    (excerpt,) = scenario.document.excerpt
    date = scenario.document.start.toordinal() + int(excerpt.day)
    rows, trace = measured(scenario, seed), emulate_file(scenario, bench_of(core), seed=seed)
    for name, method in METHODS.items():
        yield name, judged(method(rows, date), trace, core)


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
                made = made if days else Made(EQUATION_5A, lambda V, T: np.zeros(len(V)))
            days.append(judged(made, part, core))
        yield name, {figure: float(np.mean([one[figure] for one in days])) for figure in days[0]}


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
    bench = hardware.instrument(folder, "bench", settings["bench"]["sample_rate"], calibration, PAPER_FILTER)
    week = hardware.instrument(folder, "week", RATE, calibration, filter_table)

    own, all_seeds = settings["methods"], settings["seeds"]
    some_seeds = min(all_seeds, own["variant_seeds"])

    def bench_case(name: str, sensor: str, scenario: ScenarioFile, seeds: int = all_seeds) -> Case:
        return Case(name, sensor, seeds, lambda seed: on_the_bench(with_sensor(scenario, sensor), bench, seed))

    def week_case(
        name: str, sensor: str, scenario: ScenarioFile, seeds: int = all_seeds, outliers: float = 0.0
    ) -> Case:
        return Case(name, sensor, seeds, lambda seed: in_the_week(with_sensor(scenario, sensor), week, seed, outliers))

    found = []
    for sensor in own["sensors"]:
        found += [bench_case(name, sensor, scenarios[name]) for name in bench_names]
        found.append(week_case(week_name, sensor, scenarios[week_name]))
    first = own["sensors"][0]
    for name in bench_names:
        table, (excerpt,) = scenarios[name].document.calibration, scenarios[name].document.excerpt
        assert table is not None, "the scenario has measurements"
        same_day = with_calibration(scenarios[name], days=(*table.days, excerpt.day))
        found.append(bench_case(f"{name}, same day", first, same_day, some_seeds))
    near = with_calibration(scenarios[week_name], clearances=tuple(own["near"]))
    found.append(week_case(f"{week_name}, near", first, near, some_seeds))
    found.append(week_case(f"{week_name}, outliers", first, scenarios[week_name], some_seeds, own["outliers"]))
    return found


def figures(case: Case, confidence: float, progress: Callable[[int], None]) -> dict[str, Any]:
    """Return the figures of each method in a case, for its seeds."""
    found: dict[str, dict[str, list[float]]] = {}
    for seed in range(1, case.seeds + 1):
        for method, one in case.run(seed):
            for figure, value in one.items():
                found.setdefault(method, {}).setdefault(figure, []).append(round(value, DIGITS))
        progress(seed)
    accuracy = {method: spread(one["accuracy"], confidence) for method, one in found.items()}
    return {"case": case.name, "sensor": case.sensor, "methods": found, "accuracy": accuracy}


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
