"""Normal forms of what a filter computes from integers: equal forms are equal for all values of what they are made of.

::

    form       sum of rational multiples of monomials         5 x - 16 floor(x / 16 + 1/2) + 3 x y
    monomial   product of atoms; the empty one is 1
    atom       an integer: a variable, or floor(form)

Sums, products and multiples stay forms. A floor has a form of its own once everything whole is taken out of it:

    floor(5/2 x + 3/2 y - 1) = 2 x + y - 1 + floor(1/2 x + 1/2 y)

so that what is left within a floor has coefficients in [0, 1). Of a floor within a floor only the outer one is left,
``floor((m + floor(r)) / n) = floor((m + r) / n)`` with integers m and n. A floor that is constant over the ranges of
its atoms is that constant. Everything holds over the integers, of any size.

>>> forms = Forms()
>>> x = forms.variable("x", 0, 255)
>>> low = plus(x, forms.floor(times(x, {(): Fraction(1, 16)})), -16)  # the low four bits
>>> high = forms.floor(times(x, {(): Fraction(1, 16)}))
>>> plus(low, high, 16) == x
True
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from fractions import Fraction
from math import lcm

from sosmith.verify.graph import check_product

Monomial = tuple[int, ...]
"""Numbers of its atoms, in rising order."""

Form = Mapping[Monomial, int | Fraction]
"""Coefficients by monomial; none of them is 0."""

ONE: Monomial = ()
"""The monomial of a constant."""


def constant(value: int | Fraction) -> Form:
    """Return a number as a form."""
    return {ONE: value} if value else {}


def plus(a: Form, b: Form, factor: int | Fraction = 1) -> Form:
    """Return ``a + factor b``."""
    multiple = b if factor == 1 else {monomial: factor * coefficient for monomial, coefficient in b.items()}
    total = {**a, **multiple}
    for monomial in a.keys() & multiple.keys():
        total[monomial] += a[monomial]
    return {monomial: coefficient for monomial, coefficient in total.items() if coefficient}


def degree(form: Form) -> int:
    """Return the largest number of factors of a monomial."""
    return max(map(len, form), default=0)


def times(a: Form, b: Form) -> Form:
    """Return the product."""
    check_product(len(a) * len(b), degree(a) + degree(b))
    total: dict[Monomial, int | Fraction] = {}
    for p, x in a.items():
        for q, y in b.items():
            monomial = tuple(sorted((*p, *q)))
            total[monomial] = total.get(monomial, 0) + x * y
    return {monomial: coefficient for monomial, coefficient in total.items() if coefficient}


def scaled(form: Form, exponent: int) -> Form:
    """Return ``form * 2**exponent``."""
    factor = Fraction(2) ** exponent
    return {monomial: coefficient * factor for monomial, coefficient in form.items()}


def valuation(value: int | Fraction) -> int:
    """Exponent of the largest power of two that divides a dyadic number other than 0."""
    exact = Fraction(value)
    return (exact.numerator & -exact.numerator).bit_length() - exact.denominator.bit_length()


class Forms:
    """The atoms of all forms that are to be compared: the same atom has the same number."""

    def __init__(self) -> None:
        self._numbers: dict[Hashable, int] = {}
        self._ranges: list[tuple[int, int]] = []
        self._within: dict[int, Form] = {}

    def variable(self, name: Hashable, low: int, high: int) -> Form:
        """Return the integer variable `name`, which lies in low..high."""
        return self._atom(("variable", name), low, high)

    def floor(self, form: Form) -> Form:
        """Return the largest integer that is not above `form`."""
        whole: dict[Monomial, int | Fraction] = {}
        rest: dict[Monomial, int | Fraction] = {}
        for monomial, coefficient in form.items():
            below = coefficient.__floor__()
            if below:
                whole[monomial] = below
            if coefficient != below:
                rest[monomial] = coefficient - below
        nested = self._nested(rest)
        if nested is not None:
            return plus(whole, self.floor(nested))
        low, high = (end.__floor__() for end in self.extent(rest))
        if low == high:
            return plus(whole, constant(low))
        atom = self._atom(("floor", frozenset(rest.items())), low, high)
        ((number,),) = atom
        self._within[number] = rest
        return plus(whole, atom)

    def _nested(self, rest: Form) -> Form | None:
        """Return ``(m + r) / n`` for ``(m + floor(r)) / n``; None if there is not just one such floor."""
        n = lcm(*(Fraction(coefficient).denominator for coefficient in rest.values()))
        floors = [
            monomial
            for monomial, coefficient in rest.items()
            if len(monomial) == 1 and monomial[0] in self._within and coefficient == Fraction(1, n)
        ]
        if len(floors) != 1 or n == 1:
            return None
        ((atom,),) = floors
        return plus(plus(rest, {(atom,): Fraction(-1, n)}), self._within[atom], Fraction(1, n))

    def extent(self, form: Form) -> tuple[int | Fraction, int | Fraction]:
        """Return limits of a form: those of its monomials, added up."""
        low: int | Fraction = 0
        high: int | Fraction = 0
        for monomial, coefficient in form.items():
            ends = [coefficient]
            for atom in monomial:
                ends = [end * limit for end in ends for limit in self._ranges[atom]]
            low, high = low + min(ends), high + max(ends)
        return low, high

    def _atom(self, key: Hashable, low: int, high: int) -> Form:
        if key not in self._numbers:
            self._numbers[key] = len(self._ranges)
            self._ranges.append((low, high))
        return {(self._numbers[key],): 1}
