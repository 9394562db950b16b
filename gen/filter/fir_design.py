"""Design of linear-phase FIR filters by edges and losses: the fewest taps that are proven to keep to them.

The methods work in double precision; what they find is rounded to a grid, made symmetric, and scaled so that no gain in
the pass band is above 1. These taps are the filter, exactly, and `sosmith.gen.filter.gain_limits` proves that they keep
to the losses. Lengths are tried from an estimate on (Kaiser 1974), downward and then upward.

- equiripple: the Remez exchange algorithm (Parks and McClellan 1972);
- least_squares: the least integral of the squared error, weighted by the losses;
- kaiser: an ideal response cut by Kaiser's window;
- halfband: equiripple, with every other tap 0 but for the middle one. The half-band filter of 2 L - 1 taps has as its
  other taps half those of a filter of L taps whose pass band reaches to twice the edge (Vaidyanathan and Nguyen 1987).
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import signal

from sosmith.gen.filter.gain_limits import keeps_to
from sosmith.gen.filter.loss_mask import Band, LossMask
from sosmith.gen.specification.choices import MAX_TAPS
from sosmith.model.errors import SpecificationError

Array = npt.NDArray[np.float64]
_GRID_BITS = 36
"""Fraction bits of taps: fewer than the last ones of a double, which depend on the machine's functions."""

_SPARE = 2.0**-20
"""Part of the gain by which the largest one in the pass band is below 1."""

_MISSES = 2
"""Lengths in a row that do not keep to the losses, after which no shorter one is tried: odd and even ones differ."""

_DENSITY = 16
"""What scipy takes for `grid_density`."""

_POINTS = 1 << 14
"""Frequencies up to half the sample rate at which the largest gain is looked for."""


def ripples(mask: LossMask) -> tuple[float, float]:
    """Return the largest deviations from gains of 1 and 0, before the filter is scaled."""
    least = 10 ** (-float(mask.passband_loss) / 20)
    ripple = (1 - least) / (1 + least)
    return ripple, 10 ** (-float(mask.stopband_loss) / 20) * (1 + ripple)


def _transition(mask: LossMask) -> float:
    """Return the width of the narrowest transition band."""
    ends = sorted((*mask.passbands, *mask.stopbands))
    return float(min(upper[0] - lower[1] for lower, upper in pairwise(ends)))


@lru_cache(maxsize=32)
def designed_taps(family: str, mask: LossMask) -> tuple[Fraction, ...]:
    """Design the filter with the fewest taps that a family needs.

    Raises
    ------
    SpecificationError
        If 256 taps are not enough.
    """
    lengths = [length for length in range(3, MAX_TAPS + 1) if _FAMILIES[family].takes(length, mask)]
    at = min(range(len(lengths)), key=lambda k: abs(lengths[k] - _estimated(mask)))
    best, missed = _kept(family, lengths[at], mask), at
    while best is None and missed + 1 < len(lengths):
        missed += 1
        best = _kept(family, lengths[missed], mask)
    below = at - 1
    while best is not None and below >= 0 and missed - below <= _MISSES:
        shorter = _kept(family, lengths[below], mask)
        best, missed, below = (best, missed, below - 1) if shorter is None else (shorter, below, below - 1)
    if best is None:
        raise SpecificationError(
            f"filter's edges and losses must be met by at most {MAX_TAPS} taps, and are not: widen the transition band "
            "or lower stopband_loss"
        )
    return best


def _estimated(mask: LossMask) -> float:
    """Estimate the number of taps of an equiripple filter by Kaiser's formula."""
    first, second = ripples(mask)
    return (-10 * math.log10(first * second) - 13) / (14.6 * _transition(mask)) + 1


def taps_of_length(family: str, length: int, mask: LossMask) -> tuple[float, ...] | None:
    """Return a family's filter with so many taps, symmetric, of a gain about 1; None if there is none.

    Whether it keeps to the losses is not asked. The last digits depend on the machine's functions.
    """
    if length > MAX_TAPS or not _FAMILIES[family].takes(length, mask):
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of an exchange that does not converge: the proof decides
            designed = _FAMILIES[family].design(length, mask)
    except (ValueError, np.linalg.LinAlgError):
        return None
    return tuple(((designed + designed[::-1]) / 2).tolist()) if np.isfinite(designed).all() else None


def _kept(family: str, length: int, mask: LossMask) -> tuple[Fraction, ...] | None:
    """Return a filter with so many taps; None if it does not keep to the losses."""
    found = taps_of_length(family, length, mask)
    if found is None:
        return None
    designed = np.array(found)
    gain = np.abs(np.fft.rfft(designed, 2 * _POINTS))
    inside = _points_in(mask.passbands)
    scaled = designed * (1 - _SPARE) / float(np.max(gain[inside]))
    if not _may_keep(gain / float(np.max(gain[inside])), inside, mask):
        return None
    taps = tuple(Fraction(round(tap * 2.0**_GRID_BITS), 1 << _GRID_BITS) for tap in scaled.tolist())
    return taps if keeps_to(taps, mask) else None


def _points_in(bands: tuple[Band, ...]) -> npt.NDArray[np.bool_]:
    frequencies = np.arange(_POINTS + 1) / (2 * _POINTS)
    inside = np.zeros(_POINTS + 1, dtype=bool)
    for low, high in bands:
        inside |= (frequencies >= float(low)) & (frequencies <= float(high))
    return inside


def _may_keep(gain: Array, inside: npt.NDArray[np.bool_], mask: LossMask) -> bool:
    """Whether gains relative to the largest in a pass band show no loss that is not kept: a proof is worth it."""
    least, most = (10 ** (-float(loss) / 20) for loss in (mask.passband_loss, mask.stopband_loss))
    stopped = gain[_points_in(mask.stopbands)]
    return bool(gain[inside].min() > least * (1 - _SPARE) and stopped.max() < most * (1 + _SPARE))


def _edges_and_gains(mask: LossMask) -> tuple[list[float], list[float], list[float]]:
    """Return edges of all bands, and gain and weight of each."""
    first, second = ripples(mask)
    bands = sorted([(band, 1.0, 1 / first) for band in mask.passbands] + [(b, 0.0, 1 / second) for b in mask.stopbands])
    edges = [float(edge) for band, _, _ in bands for edge in band]
    return edges, [gain for _, gain, _ in bands], [weight for _, _, weight in bands]


def _equiripple(length: int, mask: LossMask) -> Array:
    edges, gains, weights = _edges_and_gains(mask)
    density = _density(edges)
    taps = signal.remez(length, edges, gains, weight=weights, fs=1.0, grid_density=density)
    return np.asarray(taps, dtype=np.float64)


def _density(edges: Sequence[float]) -> int:
    """Return frequencies for each coefficient of the exchange, so many that bands that are narrow have enough.

    With fewer than a filter has coefficients, scipy's exchange writes where it must not.
    """
    width = sum(high - low for low, high in zip(edges[::2], edges[1::2], strict=True))
    return max(_DENSITY, math.ceil(2 / width)) if width < 2 / _DENSITY else _DENSITY


def _least_squares(length: int, mask: LossMask) -> Array:
    edges, gains, weights = _edges_and_gains(mask)
    both = [gain for gain in gains for _ in range(2)]
    squares = [weight**2 for weight in weights]
    return np.asarray(signal.firls(length, edges, both, weight=squares, fs=1.0), dtype=np.float64)


def _kaiser(length: int, mask: LossMask) -> Array:
    edges, gains, _ = _edges_and_gains(mask)
    cutoffs = [(edges[k] + edges[k + 1]) / 2 for k in range(1, len(edges) - 1, 2)]
    beta = signal.kaiser_beta(-20 * math.log10(min(ripples(mask))))
    taps = signal.firwin(length, cutoffs, window=("kaiser", beta), pass_zero=gains[0] == 1, scale=False, fs=1.0)
    return np.asarray(taps, dtype=np.float64)


def _halfband(length: int, mask: LossMask) -> Array:
    ((_, edge),) = mask.passbands
    taps = np.zeros(length)
    bands = [0.0, 2 * float(edge)]
    taps[::2] = signal.remez((length + 1) // 2, bands, [1], fs=1.0, grid_density=_density(bands)) / 2
    taps[length // 2] = 0.5
    return taps


class _Family(NamedTuple):
    """How a family is designed, and what numbers of taps it has."""

    design: Callable[[int, LossMask], Array]
    takes: Callable[[int, LossMask], bool]


def _of_any_length(length: int, mask: LossMask) -> bool:
    # The gain of an even number of symmetric taps is 0 at half the sample rate.
    return length % 2 == 1 or all(band[1] < Fraction(1, 2) for band in mask.passbands)


def _of_odd_length(length: int, mask: LossMask) -> bool:
    del mask
    return length % 2 == 1


def _of_halfband_length(length: int, mask: LossMask) -> bool:
    del mask
    return length % 4 == 3


_FAMILIES = {
    "equiripple": _Family(_equiripple, _of_any_length),
    "least_squares": _Family(_least_squares, _of_odd_length),
    "kaiser": _Family(_kaiser, _of_any_length),
    "halfband": _Family(_halfband, _of_halfband_length),
}
