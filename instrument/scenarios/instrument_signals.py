"""Test signals for the instrument: clearance and temperature, converted to codes by noisy sensors."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from sosmith.gen.stimuli.plateaus import plateaus
from sosmith.gen.stimuli.run import MAX_SAMPLES, MIN_SAMPLES, Bench, Emulated, Run
from sosmith.instrument.sensors.instrument import Sensors
from sosmith.model.arithmetic.random_streams import one_stream
from sosmith.model.arrays import Codes, Values

TABLE_1_STEPS = tuple(float(d) for d in range(1, 11))
"""Clearances in mm of the run at 43 to 50 degC (the paper's table 1)."""

TABLE_2_STEPS = tuple(d / 2 for d in range(2, 21) if d != 11)
"""Clearances in mm of the run at 92 to 96 degC (the paper's table 2, which has no 5.5 mm)."""

RAMP_TEMPERATURE = (20.0, 98.0)
"""First and last temperature in degC of the temperature ramp: the range of the paper's measurements."""

RAMP_CLEARANCE = 5.0
"""Clearance in mm during the temperature ramp: the middle of the sensor's range."""

WEAR_CLEARANCE = (2.0, 9.0)
"""First and last clearance in mm of the wear ramp; with motion added it stays within the sensor's 10 mm."""

WEAR_TEMPERATURE = (43.0, 50.0)
"""First and last temperature in degC of the wear ramp: those of the paper's first run."""

MOTION = ((1.2, 0.5), (2.0, 0.3), (8.0, 0.1))
"""Frequency in Hz and amplitude in mm of the vehicle's motion at the sensor.

1.2 and 7.9 Hz are modes of a bogie at 20 m/s (Cooperrider model), 2 Hz is the paper's track irregularity of
10 m length at 20 m/s. Amplitudes are assumed: 0.5 mm is the least relative yaw of the paper's table 7
(0.00116 rad) on an arm of one wheel radius (0.46 m); shorter waves move the bogie less.
"""

MOTION_NOISE = 0.05
"""Broadband vibration of the clearance in mm rms; assumed, as the bogie's 0.0165 to 0.0648 in section 5.3."""


def bench_run(levels: tuple[float, ...], temperature: tuple[float, float]) -> Callable[[Run], Emulated]:
    """Return a run over clearances in mm, each held until the filter has settled, over a temperature ramp in degC."""

    def make(run: Run) -> Emulated:
        clearance = plateaus(run, levels, levels)
        codes = _sense(run, clearance.values, run.between(temperature))
        return Emulated(codes, clearance.values, clearance.reading)

    return make


def temperature_ramp(run: Run) -> Emulated:
    """Warm the sensor at constant clearance; read after the filter has settled. Raises if the trace is too short."""
    clearance = np.full(run.samples, RAMP_CLEARANCE)
    reading = _settled(run, RAMP_CLEARANCE)
    return Emulated(_sense(run, clearance, run.between(RAMP_TEMPERATURE)), clearance, reading)


def least_wear_ramp(bench: Bench) -> int:
    """Return the lowest number of samples of `wear_ramp`: the filter has to settle, and one is to be read."""
    return bench.settling(WEAR_CLEARANCE[1]) + 1


def wear_ramp(run: Run) -> Emulated:
    """Wear under vehicle motion; read after the filter has settled. Raises if the trace is too short."""
    wear = run.between(WEAR_CLEARANCE)
    motion = sum(
        (amplitude * np.sin(2 * np.pi * frequency * run.time) for frequency, amplitude in MOTION),
        run.rng.normal(0.0, MOTION_NOISE, run.samples),
    )
    codes = _sense(run, wear + motion, run.between(WEAR_TEMPERATURE))
    return Emulated(codes, wear, _settled(run, WEAR_CLEARANCE[1]))


def settlings(count: int, step: float) -> Callable[[Bench], int]:
    """Return a function for a default length of `count` settling times, for a `step` in the output's unit."""

    def samples(bench: Bench) -> int:
        return min(max(count * bench.settling(step), MIN_SAMPLES), MAX_SAMPLES)

    return samples


def _sense(run: Run, clearance: Values, temperature: Values) -> Codes:
    """Return the codes of the noisy sensors; the ADC saturates."""
    return Sensors().codes(clearance, temperature, run.time, run.bench.ports, one_stream(run.rng))


def _settled(run: Run, step: float) -> npt.NDArray[np.bool_]:
    """Mark the samples after the filter has settled from an initial step; raise if there are none."""
    settling = run.bench.settling(step)
    if settling >= run.samples:
        raise run.refuse_length(settling + 1, "the filter has to settle")
    return np.arange(run.samples) >= settling
