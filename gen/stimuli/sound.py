"""Test signals for sound: a tone, many tones, pink noise, and a sweep that stays where the filter passes."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from sosmith.gen.stimuli.filter_signals import SWEEP_END, scaled
from sosmith.gen.stimuli.run import MAX_SAMPLES, MIN_SAMPLES, Bench, Emulated, Run
from sosmith.model.arrays import Codes, Values
from sosmith.model.traces.trace import Tone

LEVEL = 10 ** (-1 / 20)
"""Largest value as a fraction of half the input range: 1 dB below full scale, the level of AES17 for distortion."""

USUAL_TONE = 997.0
"""Frequency of the tone in Hz where the filter passes it: that of AES17, which has no common period with the rate."""

LOWEST = 1 / 2400
"""Lowest frequency of sound as a fraction of the sample rate: 20 Hz at 48 kHz."""

_PASSES = math.sqrt(0.5)
"""Share of the largest gain from which on a frequency passes: half the power."""

_EVENLY = 0.2
"""Share of the time that the sweep spends evenly over all octaves."""

_GRID = 1000


def tone(run: Run) -> Emulated:
    """Generate a sine in the passband, below what saturates the input or the output."""
    bench = run.bench
    frequency = Fraction(f"{tone_frequency(bench):.3g}")
    cycles = float(frequency / bench.sample_rate) * np.arange(run.samples)
    codes = scaled(run, _level(bench, float(frequency)) * np.sin(2 * np.pi * cycles))
    return Emulated(codes, tone=Tone(frequency, _settling(bench)))


def tone_samples(bench: Bench) -> int:
    """Return the default length of the tone: the settling, and enough beyond it to measure, up to `MAX_SAMPLES`."""
    return min(_settling(bench) + 4 * MIN_SAMPLES, MAX_SAMPLES)


def tone_frequency(bench: Bench) -> float:
    """Return `USUAL_TONE` if the filter passes it, else the middle of the widest band that it passes, in Hz."""
    grid = _grid(bench)
    gain = bench.gain(grid)
    passes = gain >= _PASSES * gain.max()
    usual = float(np.interp(USUAL_TONE, grid, gain, left=0, right=0))
    if usual >= _PASSES * gain.max():
        return USUAL_TONE
    edges = np.flatnonzero(np.diff(np.concatenate([[False], passes, [False]])))
    first, last = max(edges.reshape(-1, 2).tolist(), key=lambda band: band[1] - band[0])
    return float(grid[(first + last - 1) // 2])


def multitone(run: Run) -> Emulated:
    """Generate sines of one level at thirds of an octave (base ten, IEC 61260-1), with random phases."""
    rate = float(run.bench.sample_rate)
    numbers = range(math.ceil(10 * math.log10(LOWEST * rate)), math.floor(10 * math.log10(0.45 * rate)) + 1)
    time, total = run.time, np.zeros(run.samples)
    for number, phase in zip(numbers, run.rng.uniform(0, 2 * np.pi, len(numbers)).tolist(), strict=True):
        total += np.sin(2 * np.pi * 10 ** (number / 10) * time + phase)
    return Emulated(_to_level(run, total))


def pink_noise(run: Run) -> Emulated:
    """Generate noise of equal power in each octave, from `LOWEST` on: white Gaussian noise, shaped in the spectrum."""
    size = 1 << (run.samples - 1).bit_length()
    spectrum = np.fft.rfft(run.rng.standard_normal(size))
    frequency = np.maximum(np.fft.rfftfreq(size), LOWEST)
    spectrum /= np.sqrt(frequency)
    spectrum[0] = 0
    return Emulated(_to_level(run, np.fft.irfft(spectrum, size)[: run.samples]))


def passband_sweep(run: Run) -> Emulated:
    """Generate a sine whose frequency rises slowly where the filter passes, and fast where it does not.

    The time in an octave goes with the power that passes, but for `_EVENLY` of all time.
    """
    grid = _grid(run.bench)
    power = run.bench.gain(grid) ** 2
    spent = power * ((1 - _EVENLY) / float(power.sum())) + _EVENLY / len(grid)  # steps of the grid are equal in octaves
    spent = np.concatenate([[0.0], np.cumsum(spent[1:])])
    frequency = np.exp(np.interp(run.progress * spent[-1], spent, np.log(grid)))
    cycles = np.cumsum(frequency) / float(run.bench.sample_rate)
    return Emulated(scaled(run, LEVEL * np.sin(2 * np.pi * cycles)))


def _grid(bench: Bench) -> Values:
    """Return frequencies in Hz at equal steps of an octave; they begin below what a slow low-pass passes."""
    rate = float(bench.sample_rate)
    linear = np.linspace(0, rate / 2, bench.bins)[1:]
    gain = bench.gain(linear)
    passes = linear[gain >= _PASSES * gain.max()]
    return np.geomspace(min(LOWEST * rate, passes[-1] / 10), SWEEP_END * rate, _GRID)


def _settling(bench: Bench) -> int:
    output = bench.output
    return bench.settling(float(output.lsb) * (output.highest - output.lowest))


def _level(bench: Bench, frequency: float) -> float:
    """Return the largest amplitude, as a fraction of half the input range, that leaves room at the output as well."""
    half_in, half_out = (float(port.lsb) * (port.highest - port.lowest) / 2 for port in (*bench.ports, bench.output))
    reached = float(bench.gain(np.array([frequency]))[0]) * half_in
    return LEVEL * min(1.0, half_out / reached) if reached else LEVEL


def _to_level(run: Run, signal: Values) -> Codes:
    return scaled(run, signal * (LEVEL / (float(np.max(np.abs(signal))) or 1.0)))
