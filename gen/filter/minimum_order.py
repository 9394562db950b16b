"""Minimum order and edges of a filter from its pass-band and stop-band edges and losses.

For a Butterworth low-pass, these are the paper's equations 10 to 13; for all other families and kinds, the results of
`scipy.signal.buttord` and similar functions. All are computed in ball arithmetic.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from flint import arb

from sosmith.gen.filter.prototypes import excess
from sosmith.model.arithmetic.correct_rounding import ceiling


def least_order(
    family: str,
    kind: str,
    passband: Sequence[arb],
    stopband: Sequence[arb],
    losses: tuple[Fraction, Fraction],
) -> tuple[int, tuple[arb, ...]]:
    """Find the smallest order that meets the losses, and the edges that do so.

    Parameters
    ----------
    family : str
        butterworth, chebyshev1, chebyshev2 or elliptic.
    kind : str
        lowpass, highpass, bandpass or bandstop.
    passband, stopband : sequence of arb
        Pre-warped edges, rising.
    losses : tuple of Fraction
        Largest loss in the pass band and smallest in the stop band, dB, positive, the first below the second.

    Returns
    -------
    order : int
        Of the prototype.
    edges : tuple of arb
        Pre-warped edges as the family defines them. Pass-band edges are met exactly, except that of a band-stop on the
        side with the looser requirement, which is met with margin.

    Raises
    ------
    UndecidedError
        If the precision is too low.
    """
    if kind == "bandstop":
        passband = _narrowed(passband, stopband)
    selectivity = _selectivity(kind, passband, stopband)
    passing, stopping = (excess(loss) for loss in losses)
    discrimination = stopping / passing  # square
    if family == "butterworth":
        order = ceiling(discrimination.log() / (2 * selectivity.log()))
        scale = passing.root(2 * order) if order > 0 else arb(1)
        return order, _rescaled(kind, passband, 1 / scale)
    if family == "elliptic":
        order = ceiling(_ratio_of_periods(1 / selectivity) / _ratio_of_periods(discrimination.rsqrt()))
        return order, tuple(passband)
    growth = discrimination.sqrt().acosh()
    order = ceiling(growth / selectivity.acosh())
    if family == "chebyshev1":
        return order, tuple(passband)
    return order, _rescaled(kind, passband, (growth / order).cosh())


def _ratio_of_periods(k: arb) -> arb:
    """``K(k) / K'(k)`` of a modulus between 0 and 1."""
    return k.agm(1) / (1 - k**2).sqrt().agm(1)


def _selectivity(kind: str, passband: Sequence[arb], stopband: Sequence[arb]) -> arb:
    """Frequency, in a prototype with its edge at 1, that corresponds to the closest stop edge; above 1."""
    if kind == "lowpass":
        return stopband[0] / passband[0]
    if kind == "highpass":
        return passband[0] / stopband[0]
    low, high = passband
    if kind == "bandstop":  # narrowed so that both stop edges are equally distant
        return (high - low) / (stopband[1] - stopband[0])
    first, second = (abs(stop**2 - low * high) / (stop * (high - low)) for stop in stopband)
    return first.min(second)


def _narrowed(passband: Sequence[arb], stopband: Sequence[arb]) -> tuple[arb, arb]:
    """Move one pass-band edge of a band-stop inwards until both stop edges are equally distant.

    This is the optimum that scipy searches for: on either side of this point, the selectivity is worse. It lies between
    the edges because ``stopband[0] < stopband[1]``.
    """
    low, high = passband
    product = stopband[0] * stopband[1]
    return low.max(product / high), high.min(product / low)


def _rescaled(kind: str, edges: Sequence[arb], factor: arb) -> tuple[arb, ...]:
    """Edges that correspond to the frequency `factor` of a prototype whose edge at 1 corresponds to `edges`."""
    if kind == "lowpass":
        return (edges[0] * factor,)
    if kind == "highpass":
        return (edges[0] / factor,)
    low, high = edges
    half = (high - low) / 2 * (factor if kind == "bandpass" else 1 / factor)
    above = half + (half**2 + low * high).sqrt()
    return low * high / above, above
