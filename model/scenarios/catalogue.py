"""Built-in scenarios by name: the paper's bench runs, ramps, vehicle motion, worst cases.

A scenario turns a `Bench` (the core's ports, sample rate and ideal behaviour) and a seed into a `Trace`,
the same on every run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sosmith.model.errors import SpecificationError
from sosmith.model.scenarios.filter_signals import noise, step, step_samples, sweep
from sosmith.model.scenarios.instrument_signals import (
    RAMP_CLEARANCE,
    TABLE_1_STEPS,
    TABLE_2_STEPS,
    WEAR_CLEARANCE,
    bench_run,
    settlings,
    temperature_ramp,
    wear_ramp,
)
from sosmith.model.scenarios.plateaus import stepped_samples
from sosmith.model.scenarios.run import MIN_SAMPLES, Bench, Emulated, Run
from sosmith.model.scenarios.worst_case_inputs import all_responses, worst_cases, worst_cases_samples
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
    description : str
        Description in one line.
    kinds : tuple of str
        Kinds of core that it is for (`Bench.kind`).
    default_samples : callable
        Returns the default length of the trace for a bench.
    make : callable
        Generates codes, truth and reading of the given length.
    """

    name: str
    description: str
    kinds: tuple[str, ...]
    default_samples: Callable[[Bench], int]
    make: Callable[[Run], Emulated]

    def default_seconds(self, bench: Bench) -> float:
        """Return the default duration of the trace in s."""
        return self.default_samples(bench) / float(bench.sample_rate)


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
    fitting = [scenario.name for scenario in SCENARIOS.values() if bench.kind in scenario.kinds]
    if name not in fitting:
        core = "a plain filter" if bench.kind == "filter" else "an instrument"
        raise SpecificationError(f"scenario for {core} must be one of {', '.join(fitting)}, not {name!r}")
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
            "clearance in steps of 1 mm from 1 to 10 mm, 43 to 50 degC (the paper's table 1)",
            ("instrument",),
            stepped_samples(TABLE_1_STEPS),
            bench_run(TABLE_1_STEPS, (43.0, 50.0)),
        ),
        Scenario(
            "bench_92_96",
            "clearance in steps of 0.5 or 1 mm from 1 to 10 mm, 92 to 96 degC (the paper's table 2)",
            ("instrument",),
            stepped_samples(TABLE_2_STEPS),
            bench_run(TABLE_2_STEPS, (92.0, 96.0)),
        ),
        Scenario(
            "temperature_ramp",
            "20 to 98 degC at a clearance of 5 mm",
            ("instrument",),
            settlings(10, RAMP_CLEARANCE),
            temperature_ramp,
        ),
        Scenario(
            "wear_ramp",
            "wear from 2 to 9 mm under vehicle motion at 1.2, 2 and 8 Hz and broadband vibration",
            ("instrument",),
            settlings(60, WEAR_CLEARANCE[1]),
            wear_ramp,
        ),
        Scenario(
            "worst_case",
            "extreme codes in the sign pattern that maximizes the filter's output",
            ("instrument", "filter"),
            lambda bench: worst_cases_samples([bench.impulse_response]),
            lambda run: worst_cases(run, [run.bench.impulse_response]),
        ),
        Scenario(
            "worst_case_errors",
            "the same for the path of each rounding error through the filter, one after another",
            ("instrument", "filter"),
            lambda bench: worst_cases_samples(all_responses(bench)),
            lambda run: worst_cases(run, all_responses(run.bench)),
        ),
        Scenario(
            "step",
            "steps of up to half the range around its middle",
            ("filter",),
            step_samples,
            step,
        ),
        Scenario(
            "sweep",
            "sine of 90 % of full scale from zero to 0.49 of the sample rate",
            ("filter",),
            lambda _bench: 4 * MIN_SAMPLES,
            sweep,
        ),
        Scenario(
            "noise",
            "white noise, uniform over all codes",
            ("filter",),
            lambda _bench: 4 * MIN_SAMPLES,
            noise,
        ),
    )
}
"""All scenarios by name, in the order in which they are listed to the user."""
