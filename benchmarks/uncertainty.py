"""Measures how often uncertainty budgets hold the true clearance: `python -m benchmarks.uncertainty`.

Emulated sensors are calibrated by the depot's measurements, and run on the paper's bench and over a week in service;
for each reading, the budget's 95 % interval is held against the true clearance. The seeds were not used while building.
And records of wear whose calibration is off by what its budget says: how often the intervals of depth, rate and life
hold.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from examples.wear_campaign import hardware
from examples.wear_campaign.bench import PAPER_FILTER
from examples.wear_campaign.methods import PRIOR, RATE, measured, until, with_sensor
from scipy import signal

from sosmith.gen.core import filter_of
from sosmith.gen.filter.design import decay_length
from sosmith.gen.instrument.uncertainty_budget import Instrument
from sosmith.gen.specification.specification import Specification, load
from sosmith.gen.specification.uncertainty import UncertaintySpec
from sosmith.model.arrays import Values
from sosmith.model.calibration.acceptance import DEFAULT_RANGES
from sosmith.model.calibration.bayesian_fit import bayesian_fit
from sosmith.model.calibration.coefficient_covariance import of_bayes
from sosmith.model.calibration.polynomial import EQUATION_5A
from sosmith.model.calibration.uncertainty import of_posterior
from sosmith.model.errors import SpecificationError
from sosmith.model.reference.golden import filtered
from sosmith.model.scenarios.catalogue import Bench
from sosmith.model.scenarios.file import ScenarioFile, emulate_file, load_scenario
from sosmith.model.sensors.inductive_sensor import FORWARD_MODELS
from sosmith.model.wear.assessment import ClearanceUncertainty, WearLimits, judge

ROOT = Path(__file__).parents[1]
SCENARIOS = ROOT / "examples" / "scenarios"
FIRST_SEED = 2001
BENCHES, WEEK = ("bench_43_50", "bench_92_96"), "a_week_in_service"
WEEK_FILTER = hardware.filter_by_order(3, 0.260435)
"""As the campaign's filter from spectra."""

KNOWN = UncertaintySpec(
    noise=Fraction("0.048"), temperature=Fraction("0.3"), voltage=None, clearance_rate=None, motion=()
)
"""What is stated of the instruments: the noise of the scenarios' sensors; 0.3 degC for thermocouple and converter."""

WEEK_KNOWN = replace(KNOWN, temperature=Fraction("0.7"), motion=((Fraction("1.2"), Fraction("0.5")),))
"""In the week, the compensation of the cold junction is 0.7 degC off, and vehicles hunt."""

Shares = list[tuple[float, float, float, float]]
"""For each run: share inside the budget, mean half-width in mm, and both for the calibration's own interval."""


def stated(folder: Path, name: str, rate: float, filter_table: str, known: UncertaintySpec) -> Specification:
    """Return the specification of an instrument."""
    path = hardware.specification(folder, name, rate, hardware.calibration_table(EQUATION_5A), filter_table)
    return replace(load(path), uncertainty=known)


def bench_for(spec: Specification, h: Values) -> Bench:
    """Return what a scenario needs to know of an instrument."""
    return Bench(
        ports=spec.inputs, output=spec.output, sample_rate=spec.sample_rate, polynomial=EQUATION_5A, impulse_response=h
    )


def shares(spec: Specification, scenario: ScenarioFile, seed: int) -> Iterator[tuple[float, float, float, float]]:
    """Yield the shares of each day of a run."""
    ideal = filter_of(spec)
    bench = bench_for(spec, _impulse_response(ideal.sos))
    rows, trace = measured(scenario, seed), emulate_file(scenario, bench, seed=seed)
    excerpts = scenario.document.excerpt
    rate = float(spec.sample_rate)
    lengths = [len(trace)] if len(excerpts) == 1 else [round((one.seconds or 0) * rate) for one in excerpts]
    day_of = np.repeat([int(one.day) for one in excerpts], lengths)
    for day in sorted(set(day_of.tolist())):
        at = day_of == day
        date = scenario.document.start.toordinal() + day
        before = until(rows, date)
        try:
            made = bayesian_fit(before, PRIOR, date, DEFAULT_RANGES)
        except SpecificationError:
            continue
        polynomial = made.fit.polynomial
        known = of_bayes(before, made)
        instrument = Instrument(spec=spec, polynomial=polynomial, known=known, ideal=ideal, bound=float(spec.max_error))
        V, T = (port.decode(trace.codes[at, k]) for k, port in enumerate(spec.inputs))
        clearance = filtered(polynomial(V, T), ideal.sos, spec.output, steady=True)
        reading = np.flatnonzero(trace.reading[at])
        reading = reading[:: max(len(reading) // 200, 1)]
        off = np.abs(clearance - trace.truth[at])[reading]
        half = instrument.budget(V[reading], T[reading]).expanded
        own = of_posterior(before, made).half_width(V[reading], T[reading])
        yield float(np.mean(off <= half)), float(half.mean()), float(np.mean(off <= own)), float(own.mean())


def _impulse_response(sos: Values) -> Values:
    impulse = np.zeros(decay_length(sos))
    impulse[0] = 1.0
    return np.asarray(signal.sosfilt(sos, impulse))


def covered(name: str, sensor: str, seeds: int) -> dict[str, Any]:
    """Return how often the intervals hold, over seeds: mean share, its standard error, mean half-width."""
    with tempfile.TemporaryDirectory() as folder:
        if name == WEEK:
            spec = stated(Path(folder), "week", RATE, WEEK_FILTER, WEEK_KNOWN)
        else:
            spec = stated(Path(folder), "bench", 6.0, PAPER_FILTER, KNOWN)
    scenario = with_sensor(load_scenario(SCENARIOS / f"{name}.toml"), sensor)
    runs = np.array(
        [np.mean(list(shares(spec, scenario, seed)), axis=0) for seed in range(FIRST_SEED, FIRST_SEED + seeds)]
    )
    mean, error = runs.mean(axis=0), runs.std(axis=0, ddof=1) / np.sqrt(seeds)
    return {
        "case": name,
        "sensor": sensor,
        "seeds": seeds,
        "budget": {"inside": _told(mean[0]), "error": _told(error[0]), "half_width": _told(mean[1])},
        "calibration": {"inside": _told(mean[2]), "error": _told(error[2]), "half_width": _told(mean[3])},
    }


def _told(value: float) -> float:
    return round(float(value), 4)


WEAR_RUNS, WEAR_DAYS, WEAR_RATE = 400, 60, 0.05
"""Records of wear, their length, and the true rate in mm a day."""

SCATTER, SYSTEMATIC, GAIN, OFFSET = 0.02, 0.10, 0.02, 0.10
"""Standard deviations: of a reading and of a day in mm, of the calibration's gain as a ratio, of its offset in mm."""


def wear_covered() -> dict[str, float]:
    """Return how often the intervals of depth, rate and life hold, with and without what the clearances are worth."""
    generator = np.random.default_rng(FIRST_SEED)
    limits = WearLimits(initial=1.5, limit=9.0)
    time = np.arange(WEAR_DAYS * 4) / 4.0
    true = 3.0 + WEAR_RATE * time
    life = (limits.critical_clearance - true[-1]) / WEAR_RATE
    inside: dict[str, list[bool]] = {}
    for _ in range(WEAR_RUNS):
        gain, offset = generator.normal(0, GAIN), generator.normal(0, OFFSET)
        of_day = np.repeat(generator.normal(0, SYSTEMATIC, WEAR_DAYS), 4)
        shown = true * (1 + gain) + offset + of_day + generator.normal(0, SCATTER, len(time))

        def worth(begin: float, now: float) -> ClearanceUncertainty:
            standard = float(np.sqrt(SCATTER**2 + SYSTEMATIC**2 + OFFSET**2 + (GAIN * now) ** 2))
            return ClearanceUncertainty(standard=standard, freedom=1e9, rise=GAIN * (now - begin))

        for name, known in (("with", worth), ("without", None)):
            report = judge(time, shown, limits, uncertainty=known)
            depth = float(true[-1]) - limits.initial
            low = 0.0 if report.life_low is None else report.life_low
            high = np.inf if report.life_high is None else report.life_high
            inside.setdefault(f"depth, {name}", []).append(report.wear_low <= depth <= report.wear_high)
            inside.setdefault(f"rate, {name}", []).append(report.rate.low <= WEAR_RATE <= report.rate.high)
            inside.setdefault(f"life, {name}", []).append(low <= life <= high)
    return {name: round(float(np.mean(found)), 4) for name, found in inside.items()}


def main() -> None:
    """Measure and print, a line of JSON for each case."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.uncertainty", description=__doc__)
    parser.add_argument("--seeds", type=int, default=40, help="seeds of each case")
    parser.add_argument("--only", choices=[*BENCHES, WEEK, "wear"], help="one of the cases")
    arguments = parser.parse_args()
    if arguments.only in {None, "wear"}:
        print(json.dumps({"case": "wear", "inside": wear_covered()}), flush=True)
    for sensor in ("equation_5a", *(name for name in FORWARD_MODELS if name != "equation_5a")):
        for name in (*BENCHES, WEEK):
            if arguments.only in {None, name}:
                print(json.dumps(covered(name, sensor, arguments.seeds)), flush=True)


if __name__ == "__main__":
    main()
