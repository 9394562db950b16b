"""Design of linear-phase FIR filters by edges and losses: the fewest taps that are proven to keep to them.

The methods work in double precision; what they find is rounded to a grid, made symmetric, and scaled so that no gain in
the pass band is above 1. These taps are the filter, exactly, and of them `sosmith.gen.filter.fir_gains` proves that the
losses are kept. Lengths are tried from an estimate on (Kaiser 1974), downward and then upward.

- equiripple: the Remez exchange algorithm (Parks and McClellan 1972);
- least_squares: the least integral of the squared error, weighted by the losses;
- kaiser: an ideal response cut by Kaiser's window;
- halfband: equiripple, with every other tap 0 but for the middle one. The half-band filter of 2 L - 1 taps has as its
  other taps half those of a filter of L taps whose pass band reaches to twice the edge (Vaidyanathan and Nguyen 1987).
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sosmith.gen.filter.fir_gains import keeps_to
from sosmith.gen.specification.choices import MAX_TAPS
from sosmith.model.errors import SpecificationError

Array = npt.NDArray[np.float64]
Band = tuple[Fraction, Fraction]

_GRID_BITS = 36
"""Fraction bits of taps: fewer than the last ones of a double, which depend on the machine's functions."""

_SPARE = 2.0**-20
"""Part of the gain by which the largest one in the pass band is below 1."""

_POINTS = 1 << 14
"""Frequencies up to half the sample rate at which the largest gain is looked for."""


class FirMask(NamedTuple):
    """What is asked for.

    Attributes
    ----------
    passbands, stopbands : tuple of Band
        Frequencies in units of the sample rate, from 0 to 1/2.
    passband_loss, stopband_loss : Fraction
        In dB: gains are from -passband_loss to 0 in a pass band, and at most -stopband_loss in a stop band.
    """

    passbands: tuple[Band, ...]
    stopbands: tuple[Band, ...]
    passband_loss: Fraction
    stopband_loss: Fraction

    @property
    def ripples(self) -> tuple[float, float]:
        """Largest deviations from gains of 1 and 0, before the filter is scaled."""
        least = 10 ** (-float(self.passband_loss) / 20)
        ripple = (1 - least) / (1 + least)
        return ripple, 10 ** (-float(self.stopband_loss) / 20) * (1 + ripple)

    @property
    def transition(self) -> float:
        """Width of the narrowest transition band."""
        ends = sorted((*self.passbands, *self.stopbands))
        return float(min(upper[0] - lower[1] for lower, upper in zip(ends, ends[1:], strict=False)))

    @property
    def is_even_possible(self) -> bool:
        """Whether the number of taps may be even: the gain at half the sample rate is then 0."""
        return all(band[1] < Fraction(1, 2) for band in self.passbands)


def mask_of(
    kind: str, passband: tuple[Fraction, ...], stopband: tuple[Fraction, ...], losses: tuple[Fraction, Fraction]
) -> FirMask:
    """Return what the edges of a kind of filter ask for; edges are in units of the sample rate, losses in dB."""
    zero, half = Fraction(0), Fraction(1, 2)
    if kind in {"lowpass", "highpass"}:
        low = (zero, (passband if kind == "lowpass" else stopband)[0])
        high = ((stopband if kind == "lowpass" else passband)[0], half)
        bands = ((low,), (high,)) if kind == "lowpass" else ((high,), (low,))
    else:
        outer, inner = (stopband, passband) if kind == "bandpass" else (passband, stopband)
        both = (zero, outer[0]), (outer[1], half)
        middle = ((inner[0], inner[1]),)
        bands = (middle, both) if kind == "bandpass" else (both, middle)
    return FirMask(*bands, *losses)


@lru_cache(maxsize=32)
def designed_taps(family: str, mask: FirMask) -> tuple[Fraction, ...]:
    """Design the filter with the fewest taps that a family needs.

    Raises
    ------
    SpecificationError
        If 256 taps are not enough.
    """
    lengths = [length for length in range(3, MAX_TAPS + 1) if _FAMILIES[family].takes(length, mask)]
    at = min(range(len(lengths)), key=lambda k: abs(lengths[k] - _estimated(mask)))
    best: tuple[Fraction, ...] | None = None
    while at >= 0 and (found := _kept(family, lengths[at], mask)) is not None:
        best, at = found, at - 1
    while best is None and at + 1 < len(lengths):
        at += 1
        best = _kept(family, lengths[at], mask)
    if best is None:
        raise SpecificationError(
            f"filter's edges and losses must be met by at most {MAX_TAPS} taps, and are not: widen the transition band "
            "or lower stopband_loss"
        )
    return best


def _estimated(mask: FirMask) -> float:
    """Estimate the number of taps of an equiripple filter by Kaiser's formula."""
    first, second = mask.ripples
    return (-10 * math.log10(first * second) - 13) / (14.6 * mask.transition) + 1


def _kept(family: str, length: int, mask: FirMask) -> tuple[Fraction, ...] | None:
    """Return a filter with so many taps; None if it does not keep to the losses."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of an exchange that does not converge: the proof decides
            made = _FAMILIES[family].design(length, mask)
    except (ValueError, np.linalg.LinAlgError):
        return None
    if not np.isfinite(made).all():
        return None
    gain = np.abs(np.fft.rfft(made, 2 * _POINTS))
    inside = np.zeros(len(gain), dtype=bool)
    for low, high in mask.passbands:
        inside[math.floor(low * 2 * _POINTS) : math.ceil(high * 2 * _POINTS) + 1] = True
    scaled = (made + made[::-1]) / 2 * (1 - _SPARE) / float(np.max(gain[inside]))
    taps = tuple(Fraction(round(tap * 2.0**_GRID_BITS), 1 << _GRID_BITS) for tap in scaled.tolist())
    return taps if keeps_to(taps, *mask) else None


def _edges_and_gains(mask: FirMask) -> tuple[list[float], list[float], list[float]]:
    """Return edges of all bands, and gain and weight of each."""
    first, second = mask.ripples
    bands = sorted([(band, 1.0, 1 / first) for band in mask.passbands] + [(b, 0.0, 1 / second) for b in mask.stopbands])
    edges = [float(edge) for band, _, _ in bands for edge in band]
    return edges, [gain for _, gain, _ in bands], [weight for _, _, weight in bands]


def _equiripple(length: int, mask: FirMask) -> Array:
    from scipy import signal  # noqa: PLC0415 - slow to load

    edges, gains, weights = _edges_and_gains(mask)
    return np.asarray(signal.remez(length, edges, gains, weight=weights, fs=1.0), dtype=np.float64)


def _least_squares(length: int, mask: FirMask) -> Array:
    from scipy import signal  # noqa: PLC0415 - slow to load

    edges, gains, weights = _edges_and_gains(mask)
    both = [gain for gain in gains for _ in range(2)]
    squares = [weight**2 for weight in weights]
    return np.asarray(signal.firls(length, edges, both, weight=squares, fs=1.0), dtype=np.float64)


def _kaiser(length: int, mask: FirMask) -> Array:
    from scipy import signal  # noqa: PLC0415 - slow to load

    edges, gains, _ = _edges_and_gains(mask)
    cutoffs = [(edges[k] + edges[k + 1]) / 2 for k in range(1, len(edges) - 1, 2)]
    beta = signal.kaiser_beta(-20 * math.log10(min(mask.ripples)))
    taps = signal.firwin(length, cutoffs, window=("kaiser", beta), pass_zero=gains[0] == 1, scale=False, fs=1.0)
    return np.asarray(taps, dtype=np.float64)


def _halfband(length: int, mask: FirMask) -> Array:
    from scipy import signal  # noqa: PLC0415 - slow to load

    ((_, edge),) = mask.passbands
    taps = np.zeros(length)
    taps[::2] = signal.remez((length + 1) // 2, [0, 2 * float(edge)], [1], fs=1.0) / 2
    taps[length // 2] = 0.5
    return taps


class _Family(NamedTuple):
    """How a family is designed, and what numbers of taps it has."""

    design: Callable[[int, FirMask], Array]
    takes: Callable[[int, FirMask], bool]


def _of_any_length(length: int, mask: FirMask) -> bool:
    return length % 2 == 1 or mask.is_even_possible


def _of_odd_length(length: int, mask: FirMask) -> bool:
    del mask
    return length % 2 == 1


def _of_halfband_length(length: int, mask: FirMask) -> bool:
    del mask
    return length % 4 == 3


_FAMILIES = {
    "equiripple": _Family(_equiripple, _of_any_length),
    "least_squares": _Family(_least_squares, _of_odd_length),
    "kaiser": _Family(_kaiser, _of_any_length),
    "halfband": _Family(_halfband, _of_halfband_length),
}
