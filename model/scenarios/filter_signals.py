"""Signals of a plain filter: steps, a sweep and noise over the input's whole range."""

from __future__ import annotations

import numpy as np

from sosmith.model.arrays import Codes, Values
from sosmith.model.scenarios.plateaus import plateaus, stepped_samples
from sosmith.model.scenarios.run import Bench, Emulated, Run

SWEEP_END = 0.49
"""Last frequency of the sweep over the sample rate, just below Nyquist's 0.5."""

SWEEP_AMPLITUDE = 0.9
"""Amplitude of the sweep over half the input's range."""

STEP_LEVELS = (0.5, -0.5, 0.25, -0.25)
"""Plateaus of the step scenario over half the input's range, from its middle.

Half of full scale leaves room for the overshoot of any usual filter.
"""


def step(run: Run) -> Emulated:
    """Step through `STEP_LEVELS`, held long enough for the filter to settle; refuses a trace that is too short."""
    steps = plateaus(run, STEP_LEVELS, _step_heights(run.bench))
    codes = _scaled(run, steps.values)
    return Emulated(codes, run.bench.ports[0].decode(codes[:, 0]), steps.reading)


def _step_heights(bench: Bench) -> tuple[float, ...]:
    """Levels of the step scenario in the input's unit."""
    port = bench.ports[0]
    middle, half = (port.highest + port.lowest) / 2, (port.highest - port.lowest) / 2
    return tuple(float(port.zero) + float(port.lsb) * (middle + half * level) for level in STEP_LEVELS)


def step_samples(bench: Bench) -> int:
    """Count the samples of the step scenario, if no length is given."""
    return stepped_samples(_step_heights(bench))(bench)


def sweep(run: Run) -> Emulated:
    """Sine whose frequency rises evenly from zero to `SWEEP_END` of the sample rate."""
    cycles = SWEEP_END / 2 * np.arange(run.samples) * run.progress
    return Emulated(_scaled(run, SWEEP_AMPLITUDE * np.sin(2 * np.pi * cycles)))


def noise(run: Run) -> Emulated:
    """White noise, uniform over all codes."""
    port = run.bench.ports[0]
    return Emulated(run.rng.integers(port.lowest, port.highest, (run.samples, 1), dtype=np.int64, endpoint=True))


def _scaled(run: Run, signal: Values) -> Codes:
    """Codes of a signal in -1..1, which stand for the ends of the input's range."""
    port = run.bench.ports[0]
    middle, half = (port.highest + port.lowest) / 2, (port.highest - port.lowest) / 2
    return np.rint(middle + half * signal).astype(np.int64)[:, np.newaxis]
