"""Curves of a run that a comparison draws again from `report.json`: error over time, its spectrum, the filter."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import numpy.typing as npt

from sosmith.gen.filter.response import FilterFacts
from sosmith.gen.report.run import Instants

Array = npt.NDArray[np.float64]

STRETCHES = 160
"""Stretches of time, at most, of which the smallest and the largest error are kept."""

_SEGMENT = 256
"""Samples of a segment of the spectrum; its lines are half of that."""

_SEGMENTS = 1 << 13
"""Segments of a spectrum that are taken at a time."""

_DIGITS = 6
"""Significant digits of a drawn value."""


def error_over_time(error: Array, instants: Array | Instants) -> dict[str, Any]:
    """Smallest and largest error in each stretch of time, over all channels.

    Parameters
    ----------
    error : ndarray, shape (n,) or (n, channels)
        Hardware minus exact calculation, in the output's unit.
    instants : ndarray or Instants, shape (n,)
        Instants of the results in s, rising.

    Returns
    -------
    dict
        ``time``: where each stretch starts, in s; ``low`` and ``high``: its smallest and largest hardware minus exact
        calculation, in the output's unit. All lists have one length, at most `STRETCHES`.
    """
    error = error.reshape(len(error), -1)
    edges = np.linspace(0, len(error), min(STRETCHES, len(error)) + 1).astype(int)
    stretches = [error[start:stop] for start, stop in itertools.pairwise(edges)]
    return {
        "time": _rounded(instants[edges[:-1]]),
        "low": _rounded(np.array([part.min() for part in stretches])),
        "high": _rounded(np.array([part.max() for part in stretches])),
    }


def error_spectrum(error: Array, instants: Array | Instants) -> dict[str, Any] | None:
    """Amplitude density of the error of one channel, by Welch's method.

    Parameters
    ----------
    error : ndarray, shape (n,)
        Hardware minus exact calculation, in the output's unit.
    instants : ndarray or Instants, shape (n,)
        Instants of the results in s, in even steps.

    Returns
    -------
    dict or None
        ``frequency`` in Hz, without zero; ``density`` in the output's unit per square root of Hz. None for fewer than
        32 samples.
    """
    if len(error) < 32:
        return None
    rate = (len(error) - 1) / float(instants[len(error) - 1] - instants[0])
    frequency, power = _spectrum(error, rate)
    return {"frequency": _rounded(frequency[1:]), "density": _rounded(np.sqrt(power[1:]))}


def _spectrum(values: Array, rate: float) -> tuple[Array, Array]:
    """Return frequencies and power densities by Welch's method, with Hann's window and without the means."""
    size = min(_SEGMENT, len(values))
    window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(size) / size)
    frequency, power = welch(values, rate, window, constant=False)
    return frequency, power / (rate * (window**2).sum())


def welch(values: Array, rate: float, window: Array, *, constant: bool = True) -> tuple[Array, Array]:
    """Return frequencies, and the mean squares of the lines of segments that overlap by half, both sides together.

    Some thousand segments are taken at a time. `scipy.signal` has the same, but takes longer to load than most
    simulations run.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The signal.
    rate : float
        Samples per second.
    window : ndarray, shape (m,)
        Weights of a segment, at most n.
    constant : bool
        Whether the mean of a segment counts.
    """
    size = len(window)
    segments = np.lib.stride_tricks.sliding_window_view(values, size)[:: size - size // 2]
    power: Array = np.zeros(size // 2 + 1)
    for first in range(0, len(segments), _SEGMENTS):
        block = segments[first : first + _SEGMENTS]
        lines = np.fft.rfft((block if constant else block - block.mean(axis=1, keepdims=True)) * window)
        power += (lines.real**2 + lines.imag**2).sum(axis=0)
    power /= len(segments)
    power[1 : (size + 1) // 2] *= 2  # those of negative frequencies; zero and half the rate have none
    return np.arange(len(power), dtype=np.float64) * (rate / size), power


def filter_curve(facts: FilterFacts | None) -> dict[str, Any] | None:
    """Sections and mask of the filter, as `FilterFacts` takes them; None for a core without one."""
    if facts is None:
        return None
    edges = {name: getattr(facts, name) for name in ("passband_edge", "stopband_edge", "cutoff")}
    return {
        "sample_rate": facts.sample_rate,
        "kind": facts.kind,
        "ideal_sos": facts.ideal_sos.tolist(),
        "quantized_sos": facts.quantized_sos.tolist(),
        **{name: None if pair is None else [float(edge) for edge in pair] for name, pair in edges.items()},
        "passband_loss": facts.passband_loss,
        "stopband_loss": facts.stopband_loss,
    }


def _rounded(values: Array) -> list[float]:
    return [float(f"{value:.{_DIGITS}g}") for value in values]
