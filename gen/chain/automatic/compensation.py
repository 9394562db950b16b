"""Taps of an FIR filter that makes up for the droop of CIC filters before it, by the Remez exchange algorithm.

With the gain P of the filters before, the own gain is to be within the pass-band loss of 1 / P, and small where it must
stop. `scipy.signal.remez` has only gains that are constant in a band; so the exchange (Parks and McClellan 1972) is
here for any. Taps are rounded to decimals, as they go into a specification, and then checked on a grid; the proof is
that of the whole chain.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import Decimal
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from sosmith.gen.specification.choices import MAX_TAPS

Array = npt.NDArray[np.float64]

_ROUNDS = 40
_GRID, _FINE = 10, 24
"""Frequencies for each tap: of the exchange, and to check."""

_ENOUGH = 0.99
"""Largest error, as a share of what is allowed, with which the exchange ends."""

_MISSES = 2
"""Lengths in a row that do not do, after which no shorter one is tried: odd and even ones differ."""

_STEPS = 12
"""Lengths beyond the expected one that are tried."""


def compensating(
    expected: int, before: Callable[[Array], Array], edge: float, stop: float, losses: tuple[float, float]
) -> list[Decimal] | None:
    """Design the shortest filter; None if `MAX_TAPS` are not enough, or far more than expected.

    Parameters
    ----------
    expected : int
        How many taps it may have, roughly.
    before : callable
        The gain P at frequencies of shape (n,), in units of the rate.
    edge, stop : float
        Edges of the pass band and the stop band, in units of the rate; 1/2 for no stop band.
    losses : (float, float)
        In dB: P times the own gain is from -losses[0] to 0 in the pass band, the own at most -losses[1] in the other.
    """
    found, length = None, min(max(expected, 3), MAX_TAPS)
    while found is None and length <= min(expected + _STEPS, MAX_TAPS):
        found = _designed(length, before, edge, stop, losses)
        length += 1
    shorter, missed = (len(found) if found else 0) - 1, 0
    while found is not None and missed < _MISSES and shorter >= 3:
        other = _designed(shorter, before, edge, stop, losses)
        found, missed = (found, missed + 1) if other is None else (other, 0)
        shorter -= 1
    return found


def _designed(
    length: int, before: Callable[[Array], Array], edge: float, stop: float, losses: tuple[float, float]
) -> list[Decimal] | None:
    ripple, rest = (1 - 10 ** (-losses[0] / 20)) / 2, 10 ** (-losses[1] / 20)
    band, out = _bands(_GRID * length, edge, stop)
    wanted = np.concatenate([(1 - ripple) / before(band), np.zeros(len(out))])
    allowed = np.concatenate([ripple / before(band), np.full(len(out), rest)])
    frequency = np.concatenate([band, out])
    # The gain of an even number of symmetric taps is cos(pi f) times a polynomial in cos(2 pi f).
    common = np.cos(np.pi * frequency) if length % 2 == 0 else np.ones(len(frequency))
    inside = common > 1e-6
    frequency, common = frequency[inside], common[inside]
    gains = _exchanged((length + 1) // 2, frequency, wanted[inside] / common, common / allowed[inside], length)
    if gains is None:
        return None
    # From the gains at multiples of 1 / length to taps that are symmetric about the middle.
    places = np.arange(length) - (length - 1) / 2
    turns = np.arange(1, (length + 1) // 2)
    taps = (gains[0] + 2 * np.cos(2 * np.pi * np.outer(places, turns) / length) @ gains[1:]) / length
    digits = math.ceil(losses[1] / 20) + 3
    half = [round(Decimal(tap), digits) for tap in taps[: (length + 1) // 2].tolist()]
    rounded = half + half[::-1][length % 2 :]
    return rounded if _keeps(rounded, before, edge, stop, (ripple, rest)) else None


def _exchanged(size: int, frequency: Array, wanted: Array, weight: Array, length: int) -> Array | None:
    """Return the gains at multiples of 1 / `length` of the sum of so many cosines whose weighted errors are at most 1.

    None if there is none, or the exchange does not find it.
    """
    x, signs = np.cos(2 * np.pi * frequency), (-1.0) ** np.arange(size + 1)
    chosen = np.round(np.linspace(0, len(x) - 1, size + 1)).astype(int)
    for _ in range(_ROUNDS):
        points = x[chosen]
        slopes = _barycentric(points)
        error = (slopes @ wanted[chosen]) / (slopes @ (signs / weight[chosen]))
        if not abs(error) <= 1:  # on these frequencies alone no filter does better
            return None
        values = wanted[chosen] - signs * error / weight[chosen]
        errors = weight * (wanted - _interpolated(points[:-1], values[:-1], x))
        if np.abs(errors).max() <= max(_ENOUGH, abs(error) * 1.0001):
            turns = np.arange((length + 1) // 2) / length
            common = np.cos(np.pi * turns) if length % 2 == 0 else 1.0
            return _interpolated(points[:-1], values[:-1], np.cos(2 * np.pi * turns)) * common
        chosen = _extremes(errors, size + 1)
        if len(chosen) <= size:
            return None
    return None


def _barycentric(points: Array) -> Array:
    """Return the weights of an interpolation, up to a common factor."""
    distances = 2 * (points[:, None] - points[None, :])
    np.fill_diagonal(distances, 1.0)
    logs = -np.log(np.abs(distances)).sum(axis=1)
    return np.asarray(np.prod(np.sign(distances), axis=1) * np.exp(logs - logs.max()), dtype=np.float64)


def _interpolated(points: Array, values: Array, x: Array) -> Array:
    """Return the polynomial through values at points, at x."""
    distances = x[:, None] - points[None, :]
    there = np.abs(distances) < 1e-14
    distances[there] = 1.0
    shares = _barycentric(points) / distances
    result = (shares @ values) / shares.sum(axis=1)
    rows, columns = np.nonzero(there)
    result[rows] = values[columns]
    return np.asarray(result, dtype=np.float64)


def _extremes(errors: Array, most: int) -> npt.NDArray[np.int64]:
    """Return the places of the largest error in each row of one sign, at most so many: those at the ends go first."""
    size, positive = np.abs(errors), errors > 0
    starts = [0, *(np.nonzero(positive[1:] != positive[:-1])[0] + 1).tolist(), len(errors)]
    kept = [start + int(np.argmax(size[start:end])) for start, end in pairwise(starts)]
    while len(kept) > most:
        kept.pop(0 if size[kept[0]] < size[kept[-1]] else -1)
    return np.array(kept, dtype=np.int64)


def _bands(points: int, edge: float, stop: float) -> tuple[Array, Array]:
    """Return frequencies in both bands, with their ends; a stop band from 1/2 on is none."""
    if stop >= 0.5:
        return np.linspace(0, edge, points), np.zeros(0)
    share = edge / (edge + 0.5 - stop)
    inside = max(16, round(points * share))
    return np.linspace(0, edge, inside), np.linspace(stop, 0.5, max(16, points - inside))


def _cosines(length: int, frequency: Array) -> Array:
    """Return the gains of pairs of symmetric taps, the innermost first."""
    places = np.arange((length + 1) // 2) + (0 if length % 2 else 0.5)
    return np.asarray(np.cos(2 * np.pi * np.outer(frequency, places)), dtype=np.float64)


def _keeps(
    taps: list[Decimal], before: Callable[[Array], Array], edge: float, stop: float, limits: tuple[float, float]
) -> bool:
    ripple, rest = limits
    length = len(taps)
    band, out = _bands(_FINE * length, edge, stop)
    inner = np.array([float(tap) for tap in taps[: (length + 1) // 2]][::-1])
    inner[1 if length % 2 else 0 :] *= 2
    passed = before(band) * (_cosines(length, band) @ inner)
    stopped = np.abs(_cosines(length, out) @ inner).max(initial=0)
    return bool(passed.min() >= 1 - 2 * ripple and passed.max() <= 1 and stopped <= rest)
