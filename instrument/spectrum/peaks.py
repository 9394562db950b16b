"""Lines of a spectrum: sine waves that stand out from the noise and from the leakage of stronger ones."""

from __future__ import annotations

import numpy as np
from scipy import stats

from sosmith.instrument.spectrum.spectra import FINER, Array, Spectrum

PEAKS = 3
"""Number of largest amplitudes that are listed."""

FALSE_LINES = 0.01
"""Expected number of lines that are found in a spectrum of noise alone."""

NEIGHBOURS = 24
"""Frequencies on each side whose median tells the density of the noise."""

OVER_LEAKAGE = 2.0
"""Multiple of the leakage of all stronger lines that a line has to exceed."""

RESOLVED = 2.5
"""Cycles in a segment from which on a line is told by frequency and amplitude, to 2 %.

Below, its image at the negative frequency and the trend are too near.
"""

DYNAMIC_RANGE = 1e-9
"""Smallest line as a part of the largest: below it are the rounding errors of the transform."""


def peaks(found: Spectrum, count: int = PEAKS) -> list[tuple[float, float]]:
    """Frequency (Hz) and amplitude of the largest lines, the largest first, at most `count`.

    Amplitudes are those of the sine waves, also between the frequencies of the spectrum. What has less than `RESOLVED`
    cycles in a segment is `unresolved`.
    """
    step = found.step / FINER
    lines = [k for k in _lines(found, count) if k >= RESOLVED * FINER]
    return [(k * step, float(found.fine_amplitude[k])) for k in lines[:count]]


def unresolved(found: Spectrum) -> float:
    """About the amplitude of a line with less than `RESOLVED` cycles in a segment; 0 if there is none."""
    slow = [found.fine_amplitude[k] for k in _lines(found, PEAKS) if 0 < k < RESOLVED * FINER]
    return float(max(slow, default=0.0))


def _lines(found: Spectrum, count: int) -> list[int]:
    """Numbers of the frequencies of the largest lines, the largest first, with those that are unresolved.

    What is left at zero frequency leaks as well, and so counts as one of these.
    """
    height = found.fine_amplitude / _one_sided(found)
    before, behind = np.append(-np.inf, height[:-1]), np.append(height[1:], -np.inf)
    local = np.flatnonzero((height > before) & (height >= behind))
    floor = _noise_amplitude(found)
    lines: list[int] = []
    last = len(height) - 1 if found.sides[-1] == 1 else len(height) + FINER  # a line this near is one at half the rate
    for k in sorted(local.tolist(), key=lambda k: (-height[k], k)):
        amplitude = found.fine_amplitude[k]
        if lines and amplitude < DYNAMIC_RANGE * found.fine_amplitude[lines[0]]:
            break
        hidden = OVER_LEAKAGE * (_leaked(found, lines, k) + found.detrended[k] * (k >= RESOLVED * FINER))
        if amplitude > max(floor[min(max(round(k / FINER), 1), len(floor) - 1)], hidden):
            lines.append(k if k < last - FINER // 2 else last)
            if sum(one >= RESOLVED * FINER for one in lines) == count:
                break
    return lines


def _one_sided(found: Spectrum) -> Array:
    """Return 2 where an amplitude includes a negative frequency, so that a line at half the rate is a maximum too."""
    sides = np.full(len(found.fine_amplitude), 2.0)
    sides[0] = 1.0
    if found.sides[-1] == 1:
        sides[-1] = 1.0
    return sides


def _leaked(found: Spectrum, lines: list[int], at: int) -> float:
    """Amplitude that lines and their images at negative frequencies show at most at frequency number `at`."""
    last = len(found.leakage) - 1
    total = 0.0
    for line in lines:
        image = min(at + line, 2 * last - at - line)
        total += found.fine_amplitude[line] * (found.leakage[abs(at - line)] + found.leakage[max(image, 0)])
    return total


def _noise_amplitude(found: Spectrum) -> Array:
    """Amplitude at each frequency that noise of the density around it hardly ever exceeds, shape (n,).

    The noise is the median density of the neighbours; its estimates have a chi-square distribution.
    """
    freedom = found.degrees_of_freedom
    around = np.lib.stride_tricks.sliding_window_view(
        np.pad(found.density[1:], NEIGHBOURS, mode="reflect"), 2 * NEIGHBOURS + 1
    )
    median = np.append(0.0, np.median(around, axis=-1))
    rare = stats.chi2.isf(FALSE_LINES / len(found.fine_amplitude), freedom) / stats.chi2.ppf(0.5, freedom)
    per_density = found.amplitude[1:] ** 2 / np.where(found.density[1:] > 0, found.density[1:], np.inf)
    limit: Array = np.sqrt(rare * median * np.max(per_density))
    return limit
