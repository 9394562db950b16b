"""Published figures of roundoff noise, and the systems that reproduce them.

Jenssen's table (Design of IIR Filters, robertgj/DesignOfIIRFilters) is for the Butterworth low-pass of order 10 and
cutoff 0.1 of the sample rate, with 10-bit coefficients and state words that hold `DELTA` standard deviations.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from sosmith.gen.realizations.noise import (
    StateSystem,
    block_optimal,
    cascade,
    companion,
    minimum_gain,
    second_order_modes,
)

Array = npt.NDArray[np.float64]
Row = tuple[float, ...]

JENSSEN = {
    "direct": (7.36, 9.93, 6.93),
    "block optimal": (1.92, 2.69, 2.62),
    "block optimal, extra bits": (1.10, 1.59, 1.59),
    "global optimal": (1.01, 1.43, 1.43),
}
"""Noise gain, and estimated and simulated variance in squares of an LSB, by structure."""

BUTTERWORTH_GAINS = (
    *(0.25, 0.375, 0.470495, 0.555541, 0.635414, 0.712132),
    *(0.786704, 0.859728, 0.931582, 1.002514, 1.072699, 1.142265),
)
"""Least noise gain of a whole Butterworth low-pass of order 1, 2, ..., for any cutoff: theory notes, 3.6."""

SECTION_GAINS = {5: (1.434017, 0.315983), 7: (2.649459, 0.446552, 0.278989)}
"""Least noise gains of the second-order sections by order of the filter, highest Q first, from the same notes."""

DELTA = 4.0  # half the range of a word over the standard deviation of its signal
COEFFICIENT = 512.0
SAMPLES = 1 << 13


def lowpass(cutoff: float, q: float) -> Row:
    """Return the Butterworth low-pass section of quality factor `q` by the bilinear transform."""
    u = math.tan(math.pi * cutoff)
    a0 = 1 + u / q + u * u
    return u * u / a0, 2 * u * u / a0, u * u / a0, 1.0, 2 * (u * u - 1) / a0, (1 - u / q + u * u) / a0


def qualities(order: int) -> list[float]:
    """Return the quality factors of the second-order sections of a Butterworth filter, highest first."""
    return [1 / (2 * math.sin(math.pi * k / (2 * order))) for k in range(1, order, 2)]


def butterworth(order: int) -> StateSystem:
    """Return a whole Butterworth low-pass with a cutoff of 0.1 of the sample rate."""
    rows = [lowpass(0.1, q) for q in qualities(order)]
    u = math.tan(math.pi * 0.1)
    single = StateSystem(np.array([[(1 - u) / (1 + u)]]), np.ones(1), np.array([2 * u / (1 + u) ** 2]), u / (1 + u))
    return cascade([*map(companion, rows), *[single][: order % 2]])


def butterworth_gain(order: int) -> float:
    """Return the least noise gain of `butterworth`."""
    return minimum_gain(second_order_modes(butterworth(order)))


def jenssen_sections(structure: str) -> list[StateSystem]:
    """Return the sections of a structure in `JENSSEN`, highest Q first; the global optimum is a single section.

    Each state is scaled to a standard deviation of 1/DELTA; coefficients are rounded to 1/512.
    """
    sections = [companion(lowpass(0.1, q)) for q in qualities(10)]
    if structure.startswith("block"):
        sections = block_optimal(sections)
    elif structure == "global optimal":
        sections = [_globally_optimal(cascade(sections))]
    deviations = np.split(np.sqrt(np.diag(cascade(sections).controllability)), len(sections))
    scaled = [s.transformed(np.diag(DELTA * d)) for s, d in zip(sections, deviations, strict=True)]
    return [
        StateSystem(
            *(np.round(m * COEFFICIENT) / COEFFICIENT for m in (s.A, s.B, s.C)),
            round(s.D * COEFFICIENT) / COEFFICIENT,
        )
        for s in scaled
    ]


def _globally_optimal(system: StateSystem) -> StateSystem:
    """Transform a system to coordinates of least noise (Hwang 1977).

    In balanced coordinates both Gramians are the diagonal matrix of the modes; plane rotations then make all
    diagonal entries equal, one per step.
    """
    lower = np.linalg.cholesky(system.controllability)
    squares, U = np.linalg.eigh(lower.T @ system.observability @ lower)
    rest = np.diag(np.sqrt(squares))
    mean = np.trace(rest) / len(rest)
    turns = np.eye(len(rest))
    for _ in range(len(rest) - 1):
        d = np.diag(rest)
        i, j = int(np.argmax(d)), int(np.argmin(d))
        turn = np.eye(len(rest))
        # tan of the angle from (d_j - mean) t**2 + 2 m_ij t + (d_i - mean) = 0, whose roots are real.
        a, b, c = d[j] - mean, 2 * rest[i, j], d[i] - mean
        angle = math.atan((-b - math.sqrt(b * b - 4 * a * c)) / (2 * a))
        turn[[i, j, i, j], [i, j, j, i]] = math.cos(angle), math.cos(angle), -math.sin(angle), math.sin(angle)
        rest, turns = turn.T @ rest @ turn, turns @ turn
    return system.transformed(lower @ U @ np.diag(squares**-0.25) @ turns)


def extra_bits(structure: str) -> Array:
    """Return the extra state bits of each section beyond the narrowest section of the structure, shape (sections,)."""
    sections = jenssen_sections(structure)
    if not structure.endswith("extra bits"):
        return np.zeros(len(sections))
    noise = cascade(sections).noise.reshape(len(sections), -1).sum(axis=1)
    return np.maximum(np.ceil(0.5 * (np.log2(noise) - np.log2(noise).mean())), 0)


def jenssen_gain(structure: str) -> float:
    """Return the noise gain with rounded coefficients."""
    sections = jenssen_sections(structure)
    noise = cascade(sections).noise.reshape(len(sections), -1).sum(axis=1)
    return float(np.sum(noise * 4.0 ** -extra_bits(structure)))


def jenssen_estimate(structure: str) -> float:
    """Return the output variance: ``(DELTA**2 gain + sum over sections of the energy of the sections after it) / 12``.

    After the last section this energy is 1. With the rounding of the output alone, as in Jenssen's text, the variance
    would be ``(DELTA**2 gain + 1) / 12``.
    """
    sections = jenssen_sections(structure)
    after = sum(cascade(sections[k:]).energy for k in range(1, len(sections))) + 1
    return (DELTA**2 * jenssen_gain(structure) + after) / 12


def jenssen_simulated(structure: str) -> float:
    """Return the output variance, measured with uniform noise as input."""
    sections, extra = jenssen_sections(structure), extra_bits(structure)
    samples = np.random.default_rng(1).random(SAMPLES) - 0.5
    samples = np.round(samples * 1024 / (samples.std() * DELTA))
    exact, rounded = (_simulate(sections, samples, extra, rounding=rounding) for rounding in (False, True))
    return float(np.var(exact - rounded))


def _simulate(sections: list[StateSystem], samples: Array, extra: Array, *, rounding: bool) -> Array:
    """Run a cascade with section outputs rounded to integers and states to `extra` fraction bits."""
    states = [np.zeros(len(s.B)) for s in sections]
    units = 2.0**-extra
    results = np.empty(len(samples))
    for n, u in enumerate(samples):
        signal_so_far = u
        for i, s in enumerate(sections):
            x, y = s.A @ states[i] + s.B * signal_so_far, s.C @ states[i] + s.D * signal_so_far
            states[i] = np.floor(x / units[i] + 0.5) * units[i] if rounding else x
            signal_so_far = math.floor(y + 0.5) if rounding else y
        results[n] = signal_so_far
    return results
