"""Test signals for a plain filter: steps, a sweep and noise over the whole input range."""

from __future__ import annotations

import numpy as np

from sosmith.gen.stimuli.plateaus import plateaus, stepped_samples
from sosmith.gen.stimuli.run import Bench, Emulated, Run
from sosmith.model.arrays import Codes, Values

SWEEP_END = 0.49
"""Last frequency of the sweep as a fraction of the sample rate, just below the Nyquist frequency of 0.5."""

SWEEP_AMPLITUDE = 0.9
"""Amplitude of the sweep as a fraction of half the input range."""

STEP_LEVELS = (0.5, -0.5, 0.25, -0.25)
"""Levels of the step scenario as fractions of half the input range, from its middle.

Half of full scale leaves room for the overshoot of common filters.
"""


def step(run: Run) -> Emulated:
    """Step through `STEP_LEVELS`, each held until the filter has settled; raises if the trace is too short."""
    steps = plateaus(run, STEP_LEVELS, _step_heights(run.bench))
    codes = scaled(run, steps.values)
    return Emulated(codes, run.bench.ports[0].decode(codes[:, 0]), steps.reading)


def _step_heights(bench: Bench) -> tuple[float, ...]:
    """Return the levels of the step scenario in the unit of the input."""
    port = bench.ports[0]
    middle, half = (port.highest + port.lowest) / 2, (port.highest - port.lowest) / 2
    return tuple(float(port.zero) + float(port.lsb) * (middle + half * level) for level in STEP_LEVELS)


def step_samples(bench: Bench) -> int:
    """Return the default length of the step scenario in samples."""
    return stepped_samples(_step_heights(bench))(bench)


def sweep(run: Run) -> Emulated:
    """Generate a sine whose frequency rises linearly from zero to `SWEEP_END` of the sample rate."""
    cycles = SWEEP_END / 2 * np.arange(run.samples) * run.progress
    return Emulated(scaled(run, SWEEP_AMPLITUDE * np.sin(2 * np.pi * cycles)))


def noise(run: Run) -> Emulated:
    """Generate white noise, uniform over all codes."""
    port = run.bench.ports[0]
    return Emulated(run.rng.integers(port.lowest, port.highest, (run.samples, 1), dtype=np.int64, endpoint=True))


def scaled(run: Run, signal: Values) -> Codes:
    """Return the codes of a signal in -1..1, where -1 and 1 are the ends of the input range."""
    port = run.bench.ports[0]
    middle, half = (port.highest + port.lowest) / 2, (port.highest - port.lowest) / 2
    return np.rint(middle + half * signal).astype(np.int64)[:, np.newaxis]
