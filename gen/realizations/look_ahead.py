"""Makes the stages of a filter with scattered look-ahead: one FIR filter for all zeros, then a recursion each.

A section ``B(w) / A(w)``, w = 1/z, has look-ahead over M samples if both are multiplied by ``D(w**M) / A(w)``, where
the poles of D are the M-th powers of those of A::

    x --> all B(w) D(w**M) / A(w) multiplied out --> 1 / D(w**M) of one section --> of the next --> .. --> y

The input of a filter has few bits, so that a tap takes a single multiplier block; its products drop bits before they
are added up, as those of the recursions do (`sosmith.model.sections.floored_products`). Recursions follow one another
from the poles that lie closest to the unit circle to those that lie furthest from it: what the first ones round then
passes the others, whose gain is small. Beyond `_MOST_IN_FRONT` samples there would be too many taps; the recursions
double what is left (`sosmith.model.sections.look_ahead`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

from sosmith.gen.realizations.section_format import WIDE, SectionFormat
from sosmith.model.errors import ShortfallError
from sosmith.model.sections.fir import FirSection, Form, TapProduct
from sosmith.model.sections.look_ahead import LookAhead, Tap

Row = Sequence[float]
Polynomial = tuple[Fraction, ...]
"""Coefficients in rising powers of w."""

_MOST_IN_FRONT = 4
"""Samples of look-ahead whose polynomials go into the FIR filter: it has as many taps as these times the poles."""

_ALL = 1 << 12
"""More fraction bits than any signal has."""

_NAMES = "abcdefgh"
"""Letters of the polynomials in front of a recursion: a1 and a2 of the first one, b1 and b2 of the second."""


@dataclass(frozen=True)
class Zeros:
    """The FIR filter in front, by its taps."""

    numerator: Polynomial

    @cached_property
    def taps(self) -> tuple[tuple[str, float, int], ...]:
        """Name, value and delay of each tap that is not too small for a double."""
        return tuple((f"b{k}", float(tap), k) for k, tap in enumerate(self.numerator) if float(tap))

    @property
    def transfer(self) -> tuple[Polynomial, Polynomial]:
        """Numerator and denominator."""
        return self.numerator, (Fraction(1),)


class Poles(NamedTuple):
    """A recursion: the samples that it goes back, what doubles them in powers of w, and the denominator in ``w**M``."""

    distance: int
    factors: tuple[tuple[int, Polynomial], ...]
    denominator: Polynomial

    @property
    def transfer(self) -> tuple[Polynomial, Polynomial]:
        """Numerator and denominator."""
        numerator: Polynomial = (Fraction(1),)
        for step, factor in self.factors:
            numerator = _product(numerator, _spread(factor, step))
        return numerator, _spread(self.denominator, self.distance)


def look_ahead_parts(rows: Sequence[Row], *, distance: int) -> list[Zeros | Poles]:
    """Return the parts of a filter with look-ahead over `distance` samples, exact for the rows b0, b1, b2, 1, a1, a2.

    >>> look_ahead_parts([[1, 0, 0, 1, -1, 0.5]], distance=2)[0].numerator
    (Fraction(1, 1), Fraction(1, 1), Fraction(1, 2))
    >>> look_ahead_parts([[1, 0, 0, 1, -1, 0.5]], distance=2)[1].denominator
    (Fraction(1, 1), Fraction(0, 1), Fraction(1, 4))
    """
    front = distance
    while front > _MOST_IN_FRONT:
        front //= 2
    zeros: Polynomial = (Fraction(1),)
    poles = []
    for row in sorted(rows, key=lambda row: -row[5]):
        own = _trimmed(row[3:])
        denominator = _powered(own, front)
        zeros = _product(zeros, _product(_trimmed(row[:3]), _quotient(_spread(denominator, front), own)))
        factors = []
        step = front
        while step < distance:
            factors.append((step, tuple(value * (-1) ** k for k, value in enumerate(denominator))))
            denominator = _powered(denominator, 2)
            step *= 2
        if len(denominator) > 1:
            poles.append(Poles(distance, tuple(factors), denominator))
    return [Zeros(zeros), *poles]


def look_ahead(part: Zeros | Poles, form: SectionFormat, name: str) -> FirSection | LookAhead:
    """Make a stage in given formats.

    Raises
    ------
    ShortfallError
        If the filter passes nothing, or its rounded coefficients are unstable.
    """
    if isinstance(part, Zeros):
        rounding = form.rounding
        rounded = [(name, *rounding(name, value), ((delay, 1),)) for name, value, delay in part.taps]
        products = tuple(TapProduct(*each, form.fracs.get(f"product_{each[0]}")) for each in rounded if each[1])
        if not products:
            raise ShortfallError(f"numerator of {name} must not be zero")
        return FirSection(name=name, products=products, form=Form.TRANSPOSED, x=form.x)
    # If no quantizer has a format, all keep as many bits as the input has; otherwise a missing one had none to drop.
    most, wide = _ALL if form.fracs else form.x.frac, (-WIDE, WIDE)
    quantizers = [f"u{k}" for k in range(len(part.factors) + 1)] if part.factors else []
    try:
        return LookAhead(
            name=name,
            distance=part.distance,
            factors=tuple(_taps(form, letter, *factor) for letter, factor in zip(_NAMES, part.factors, strict=False)),
            recursion=_taps(form, "A", part.distance, part.denominator),
            x=form.x,
            fracs=tuple(form.fracs.get(each, most) for each in quantizers),
            ranges=tuple(form.ranges.get(each, wide) for each in quantizers),
            y_frac=form.fracs.get("v", most),
            v_range=form.ranges.get("v", wide),
        )
    except ValueError as error:
        raise ShortfallError(f"{name} must be stable with coefficients of {form.rounding.bits} bits: {error}") from None


def _taps(form: SectionFormat, letter: str, step: int, polynomial: Polynomial) -> tuple[Tap, ...]:
    """Round a polynomial's coefficients but the one; those that are too small for a double are none."""
    rounding = form.rounding
    return tuple(
        Tap(name, *rounding(name, float(value)), k * step, form.fracs.get(f"product_{name}"))
        for k, value in enumerate(polynomial)
        for name in [f"{letter}{k}"]
        if k and float(value)
    )


def _trimmed(values: Sequence[float]) -> Polynomial:
    """Return a polynomial without the zeros at its end."""
    polynomial = [Fraction(value) for value in values]
    while len(polynomial) > 1 and not polynomial[-1]:
        polynomial.pop()
    return tuple(polynomial)


def _powered(denominator: Polynomial, power: int) -> Polynomial:
    """Return the polynomial whose poles are powers of those of another, which has two of them at most.

    The sum of the powers of two numbers follows from those of the two powers before, their sum and their product.

    >>> _powered((Fraction(1), Fraction(-5), Fraction(6)), 3)  # 2 and 3 become 8 and 27
    (Fraction(1, 1), Fraction(-35, 1), Fraction(216, 1))
    """
    _, first, second = (*denominator, Fraction(0), Fraction(0))[:3]
    before, now = Fraction(len(denominator) - 1), -first
    for _ in range(power - 1):
        before, now = now, -first * now - second * before
    return (Fraction(1), -now, second**power)[: len(denominator)]


def _spread(polynomial: Polynomial, step: int) -> Polynomial:
    """Return a polynomial in a power of w as one in w."""
    spread = [Fraction(0)] * ((len(polynomial) - 1) * step + 1)
    spread[::step] = polynomial
    return tuple(spread)


def _product(one: Polynomial, other: Polynomial) -> Polynomial:
    total = [Fraction(0)] * (len(one) + len(other) - 1)
    for i, a in enumerate(one):
        for j, b in enumerate(other):
            total[i + j] += a * b
    return tuple(total)


def _quotient(one: Polynomial, other: Polynomial) -> Polynomial:
    """Divide a polynomial by one that divides it and begins with 1."""
    rest = list(one)
    for k in range(len(one) - len(other) + 1):
        for i, value in enumerate(other[1:], start=1):
            rest[k + i] -= rest[k] * value
    return tuple(rest[: len(one) - len(other) + 1])
