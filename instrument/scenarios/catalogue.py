"""Built-in scenarios by name: the paper's bench runs, ramps, vehicle motion, worst cases.

A scenario turns a `Bench` (the core's ports, sample rate and ideal behaviour) and a seed into a `Trace`,
the same on every run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sosmith.gen.stimuli.filter_signals import noise, step, step_samples, sweep
from sosmith.gen.stimuli.plateaus import stepped_samples
from sosmith.gen.stimuli.run import MIN_SAMPLES, Bench, Emulated, Run
from sosmith.gen.stimuli.sound import multitone, passband_sweep, pink_noise, tone, tone_samples
from sosmith.gen.stimuli.worst_case_inputs import all_responses, worst_cases, worst_cases_samples
from sosmith.instrument.scenarios.instrument_signals import (
    RAMP_CLEARANCE,
    TABLE_1_STEPS,
    TABLE_2_STEPS,
    WEAR_CLEARANCE,
    bench_run,
    settlings,
    temperature_ramp,
    wear_ramp,
)
from sosmith.instrument.scenarios.summaries import check_scenario
from sosmith.model.errors import SpecificationError
from sosmith.model.traces.trace import Trace

LIMIT_SAMPLES = 10_000_000
"""Largest number of samples of a trace (several hundred megabytes), to catch durations in a wrong unit."""


@dataclass(frozen=True)
class Scenario:
    """A named generator of traces.

    Attributes
    ----------
    name : str
        Name on the command line.
    default_samples : callable
        Returns the default length of the trace for a bench.
    make : callable
        Generates codes, truth and reading of the given length.
    """

    name: str
    default_samples: Callable[[Bench], int]
    make: Callable[[Run], Emulated]


def emulate(name: str, bench: Bench, *, seed: int, seconds: float | None = None) -> Trace:
    """Generate the trace of the scenario `name` for a core.

    Parameters
    ----------
    name : str
        A key of `SCENARIOS` that is for this kind of core.
    bench : Bench
        The core.
    seed : int
        Seed of all noise, 0 or more. Equal seeds give equal traces.
    seconds : float, optional
        Duration in s; by default long enough for the filter to settle where needed, with `MIN_SAMPLES` to
        `MAX_SAMPLES` samples.

    Raises
    ------
    SpecificationError
        If no scenario for this kind of core has that name; if the duration is not positive, too short for the scenario
        or above `LIMIT_SAMPLES`; if the seed is negative.
    """
    check_scenario(name, bench.kind)
    if seed < 0:
        raise SpecificationError(f"seed must be 0 or more, not {seed}")
    scenario = SCENARIOS[name]
    samples = scenario.default_samples(bench) if seconds is None else _samples(bench, seconds)
    signal = scenario.make(Run(name, bench, samples, np.random.default_rng(seed)))
    return Trace(
        name=name,
        ports=bench.ports,
        sample_rate=bench.sample_rate,
        codes=signal.codes,
        truth=signal.truth,
        reading=signal.reading,
        tone=signal.tone,
        seed=seed,
    )


def _samples(bench: Bench, seconds: float) -> int:
    if not seconds * bench.sample_rate >= 1:  # also for NaN
        least = 1 / float(bench.sample_rate)
        raise SpecificationError(f"seconds must be at least {least:.6g}, one sample, not {seconds}")
    if seconds * bench.sample_rate > LIMIT_SAMPLES:
        most = LIMIT_SAMPLES / float(bench.sample_rate)
        raise SpecificationError(f"seconds must be at most {most:.6g}, {LIMIT_SAMPLES} samples, not {seconds}")
    return round(seconds * float(bench.sample_rate))


SCENARIOS: dict[str, Scenario] = {
    scenario.name: scenario
    for scenario in (
        Scenario(
            "bench_43_50",
            stepped_samples(TABLE_1_STEPS),
            bench_run(TABLE_1_STEPS, (43.0, 50.0)),
        ),
        Scenario(
            "bench_92_96",
            stepped_samples(TABLE_2_STEPS),
            bench_run(TABLE_2_STEPS, (92.0, 96.0)),
        ),
        Scenario(
            "temperature_ramp",
            settlings(10, RAMP_CLEARANCE),
            temperature_ramp,
        ),
        Scenario(
            "wear_ramp",
            settlings(60, WEAR_CLEARANCE[1]),
            wear_ramp,
        ),
        Scenario(
            "worst_case",
            lambda bench: worst_cases_samples([bench.impulse_response]),
            lambda run: worst_cases(run, [run.bench.impulse_response]),
        ),
        Scenario(
            "worst_case_errors",
            lambda bench: worst_cases_samples(all_responses(bench)),
            lambda run: worst_cases(run, all_responses(run.bench)),
        ),
        Scenario(
            "step",
            step_samples,
            step,
        ),
        Scenario(
            "sweep",
            lambda _bench: 4 * MIN_SAMPLES,
            sweep,
        ),
        Scenario(
            "noise",
            lambda _bench: 4 * MIN_SAMPLES,
            noise,
        ),
        Scenario(
            "passband_sweep",
            lambda _bench: 4 * MIN_SAMPLES,
            passband_sweep,
        ),
        Scenario(
            "tone",
            tone_samples,
            tone,
        ),
        Scenario(
            "multitone",
            lambda _bench: 4 * MIN_SAMPLES,
            multitone,
        ),
        Scenario(
            "pink_noise",
            lambda _bench: 4 * MIN_SAMPLES,
            pink_noise,
        ),
    )
}
"""How each scenario is made, by name."""
