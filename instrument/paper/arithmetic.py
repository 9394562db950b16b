"""Butterworth low-passes in exact arithmetic: polynomials, bilinear transformation, poles, rounding to digits.

At a cutoff of 1/386 of the sample rate, evaluating a 7th-order denominator near z = 1 loses 16 digits, so double
precision is useless. Here coefficients are fractions; irrational ones are computed to 100 digits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Context, Decimal
from fractions import Fraction
from functools import cache
from typing import cast

from flint import acb, arb, ctx, fmpz_poly

from sosmith.instrument.paper.comparison import decimal_of

Coefficients = tuple[Fraction, ...]

_DIGITS = 100
_BITS = 512  # of ball arithmetic; far more than the digits kept


def butterworth_polynomial(order: int) -> Coefficients:
    """Coefficients of ``prod(s - s_k)`` by falling powers of s, with all poles s_k on the left half of the unit circle.

    Equations 15 and 21 of the paper. Correct to 100 digits.
    """
    product: Coefficients = (Fraction(1),)
    for factor in butterworth_factors(order):
        product = multiply(product, factor)
    return product


@cache
def butterworth_factors(order: int) -> tuple[Coefficients, ...]:
    """Real factors of `butterworth_polynomial` by falling powers: ``s^2 + 2 sin(theta) s + 1``, and s + 1 if odd.

    Sections with the highest Q come first.
    """
    factors: list[Coefficients] = []
    with ctx.workprec(_BITS):
        for k in range(1, order, 2):
            sine = (arb.pi() * k / (2 * order)).sin()
            middle = Fraction(Decimal(str((2 * sine).str(_DIGITS, radius=False))))
            factors.append((Fraction(1), middle, Fraction(1)))
    return (*factors, *([(Fraction(1), Fraction(1))] if order % 2 else []))


def multiply(first: Coefficients, second: Coefficients) -> Coefficients:
    """Product of two polynomials, both by falling or both by rising powers."""
    product = [Fraction(0)] * (len(first) + len(second) - 1)
    for i, a in enumerate(first):
        for j, b in enumerate(second):
            product[i + j] += a * b
    return tuple(product)


def scaled(polynomial: Coefficients, cutoff: Fraction) -> Coefficients:
    """``polynomial(s / cutoff)`` by falling powers: equations 16 and 22."""
    degree = len(polynomial) - 1
    return tuple(value / cutoff ** (degree - k) for k, value in enumerate(polynomial))


def cutoffs_of(polynomial: Coefficients, printed: Sequence[Decimal]) -> list[float]:
    """Cutoffs in rad/s for which each coefficient of ``polynomial(s / cutoff)``, except the last, is as printed."""
    degree = len(printed) - 1
    return [math.pow(polynomial[k] / Fraction(printed[k]), 1 / (degree - k)) for k in range(degree)]


def bilinear(denominator: Coefficients, period: Fraction) -> tuple[Coefficients, Coefficients]:
    """Numerator and denominator of ``1 / denominator(s)`` at ``s = 2 / period * (1 - 1/z) / (1 + 1/z)``, equation 17.

    Parameters
    ----------
    denominator : tuple of Fraction
        By falling powers of s.
    period : Fraction
        Sampling period in s.

    Returns
    -------
    tuple of tuple of Fraction
        By rising powers of 1/z; the denominator begins with 1.
    """
    degree = len(denominator) - 1
    rising, falling = (Fraction(1), Fraction(1)), (Fraction(1), Fraction(-1))
    total = [Fraction(0)] * (degree + 1)
    for power, value in enumerate(reversed(denominator)):
        term: Coefficients = (value * (2 / period) ** power,)
        for factor in [falling] * power + [rising] * (degree - power):
            term = multiply(term, factor)
        total = [a + b for a, b in zip(total, term, strict=True)]
    numerator = [Fraction(math.comb(degree, k)) for k in range(degree + 1)]
    return tuple(b / total[0] for b in numerator), tuple(a / total[0] for a in total)


def dc_gain(numerator: Sequence[Fraction], denominator: Sequence[Fraction]) -> Fraction:
    """Gain at z = 1."""
    return sum(numerator, Fraction(0)) / sum(denominator, Fraction(0))


def poles(denominator: Sequence[Fraction]) -> list[complex]:
    """Poles in z of a denominator by rising powers of 1/z, to proven accuracy; the farthest from the origin first."""
    common = math.lcm(*(value.denominator for value in denominator))
    integers = [int(value * common) for value in reversed(denominator)]
    with ctx.workprec(_BITS):
        roots = cast("list[tuple[acb, int]]", fmpz_poly(integers).complex_roots())
        found = [complex(root) for root, count in roots for _ in range(count)]
    return sorted(found, key=lambda pole: (-abs(pole), pole.imag))


def pole_radii(denominator: Sequence[Fraction]) -> list[float]:
    """Magnitudes of `poles`, largest first; all below 1 if and only if the filter is stable."""
    return [abs(pole) for pole in poles(denominator)]


def rounded(values: Sequence[Fraction], digits: int) -> Coefficients:
    """Round each of `values` to `digits` significant digits, ties to even."""
    context = Context(prec=digits)
    return tuple(Fraction(context.create_decimal(decimal_of(value))) for value in values)


@cache
def digits_for_stability(denominator: Coefficients, most: int = 40) -> int:
    """Smallest number of significant digits from which on, up to `most`, the rounded denominator is stable."""
    fewest = most
    while fewest > 1 and pole_radii(rounded(denominator, fewest - 1))[0] < 1:
        fewest -= 1
    return fewest


def loss_db(angular: float, cutoff: float, order: int) -> float:
    """Loss of a Butterworth low-pass in dB at an analog angular frequency, both in rad/s: equation 9."""
    return 10 * math.log10(1 + (angular / cutoff) ** (2 * order))


def ripple(loss: float) -> float:
    """``sqrt(10^(0.1 loss) - 1)`` of a loss in dB: the terms of equations 12 and 13."""
    return math.sqrt(10 ** (0.1 * loss) - 1)


def order_needed(passband: float, stopband: float, passband_loss: float, stopband_loss: float) -> float:
    """Order by equation 12, before rounding up; edges in rad/s, losses in dB."""
    return math.log(ripple(stopband_loss) / ripple(passband_loss)) / math.log(stopband / passband)


def cutoff_for(passband: float, passband_loss: float, order: float) -> float:
    """Cutoff in rad/s by equation 13: the loss at the pass band's edge is met exactly."""
    return passband / math.pow(ripple(passband_loss), 1 / order)


def gain_db(
    numerator: Sequence[Fraction], denominator: Sequence[Fraction], frequency: float, sample_rate: float
) -> float:
    """Gain in dB at a frequency in Hz below half the sample rate, of polynomials by rising powers of 1/z."""
    with ctx.workprec(_BITS):
        angle = arb.pi() * 2 * arb(frequency) / arb(sample_rate)
        back = acb(angle.cos(), -angle.sin())
        magnitudes = [abs(_polynomial(values, back)) for values in (numerator, denominator)]
        return float(20 * (magnitudes[0] / magnitudes[1]).log() / arb(10).log())


def _polynomial(values: Sequence[Fraction], variable: acb) -> acb:
    result = acb(0)
    for value in reversed(values):
        result = result * variable + acb(arb(value.numerator) / arb(value.denominator))
    return result


def prewarped(frequency: float, period: float) -> float:
    """Analog angular frequency in rad/s for a frequency in Hz: equations 10 and 11."""
    return 2 / period * math.tan(math.pi * frequency * period)
