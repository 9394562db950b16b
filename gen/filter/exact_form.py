"""The exact filter that everything is proven against, in the one form that it has: rationals with hundreds of bits.

A derived filter is its first sample, followed by factors of its numerator and denominator that begin with 1: one for
each conjugate pair of zeros or poles, one for each real zero, and one for all real poles, both in the order of their
coefficients. A sampled one has its whole numerator in place of the first sample. So nothing is left to a choice: who
derives the filter again from the same words has the same digits, and `sosmith verify` compares them. Given sections
stay as they were given.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import zip_longest
from math import prod

from flint import acb, arb, arb_poly

from sosmith.gen.filter.transformations import DigitalFilter
from sosmith.model.arithmetic.correct_rounding import ball, nearest_multiple, sign

Exact = tuple[tuple[Fraction, ...], tuple[Fraction, ...]]
"""Numerator and denominator of a section: coefficients of powers of 1/z, without trailing zeros."""

Taps = tuple[arb, ...]
"""A factor with one zero or pole, or with two: its coefficients behind the leading 1."""

_SPARE_BITS = 192
"""Fraction bits of exact coefficients if all poles lie at z = 0."""

_LARGEST = 52
"""The circle nearest to the unit circle by which poles are told apart: ``2**-52`` below it."""


def exact_bilinear(filter_: DigitalFilter) -> tuple[Exact, ...]:
    """Return the exact form of a filter by poles, zeros and a gain.

    Raises
    ------
    UndecidedError
        If a number does not round to one multiple.
    """
    zeros: list[Taps] = [(-2 * cosine, arb(1)) for cosine in filter_.zero_cosines]
    zeros += [(arb(-zero),) for zero in filter_.real_zeros]
    poles = pole_factors(filter_.pole_pairs, filter_.real_poles)
    w = 1 / filter_.passing
    above, below = (
        prod((abs(arb_poly([1, *taps])(w)) for taps in factors), start=arb(1)) for factors in (zeros, poles)
    )
    return exact_form([filter_.level * below / above], zeros, poles)


def pole_factors(pairs: Sequence[acb], real: Sequence[arb]) -> list[Taps]:
    """Return the factors of a denominator: of each conjugate pair of poles, and of all real ones, at most two."""
    factors: list[Taps] = [(-2 * pole.real, pole.real**2 + pole.imag**2) for pole in pairs]
    if len(real) == 1:
        factors.append((-real[0],))
    elif real:
        first, second = real
        factors.append((-first - second, first * second))
    return factors


def exact_form(first: Sequence[arb], zeros: Sequence[Taps], poles: Sequence[Taps]) -> tuple[Exact, ...]:
    """Round a filter, given by the factors of its numerator and denominator and what its numerator has before them.

    Raises
    ------
    UndecidedError
        If a number does not round to one multiple.
    """
    frac = _SPARE_BITS + sum(map(_amplification, poles))
    one = (Fraction(1),)

    def rounded(taps: Sequence[arb]) -> tuple[Fraction, ...]:
        return tuple(nearest_multiple(tap, frac) for tap in taps)

    over, under = (sorted(_shortened(one + rounded(taps)) for taps in factors) for factors in (zeros, poles))
    return (_shortened(rounded(first)), one), *zip_longest(over, under, fillvalue=one)


def given_form(rows: Sequence[Sequence[Fraction]]) -> tuple[Exact, ...]:
    """Round given sections (b0, b1, b2, 1, a1, a2), or of other orders in the same form.

    Raises
    ------
    UndecidedError
        If the precision does not tell a pole from a circle.
    """
    below = [tuple(map(ball, _shortened(row[len(row) // 2 :])[1:])) for row in rows]
    return rounded_rows(rows, _SPARE_BITS + sum(map(_amplification, below)))


def rounded_rows(rows: Sequence[Sequence[Fraction]], frac: int) -> tuple[Exact, ...]:
    """Round given sections to `frac` fraction bits."""
    nearest = [[Fraction(round(value * 2**frac), 2**frac) for value in row] for row in rows]
    return tuple((_shortened(row[: len(row) // 2]), _shortened(row[len(row) // 2 :])) for row in nearest)


def _amplification(taps: Taps) -> int:
    """Count bits: by how much an error of a coefficient is amplified, ``1 / (1 - radius)**2`` for each pole.

    The radius is rounded up to the next ``1 - 2**-k``.
    """
    k = next((k for k in range(1, _LARGEST) if _within(taps, k)), _LARGEST)
    return 2 * k * len(taps)


def _within(taps: Taps, k: int) -> bool:
    """Whether all poles of a factor lie within the circle of the radius ``1 - 2**-k``, by its Schur-Cohn conditions."""
    radius = 1 - arb(2) ** -k
    if not taps:
        return True
    if len(taps) == 1:
        return sign(radius - abs(taps[0])) > 0
    first, second = taps[0], taps[1]
    return sign(radius**2 - abs(second)) > 0 and sign(radius**2 + second - abs(first) * radius) > 0


def _shortened(taps: Sequence[Fraction]) -> tuple[Fraction, ...]:
    """Drop trailing zeros."""
    return tuple(taps[: max((k + 1 for k, value in enumerate(taps) if value), default=1)])
