"""Impulse responses as quotients of polynomials, exact."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce

from flint import fmpq_poly

from sosmith.gen.proof.nodes import polynomial
from sosmith.gen.proof.poles import Coefficients


@dataclass(frozen=True)
class Response:
    """An impulse response.

    Attributes
    ----------
    numerator : fmpq_poly
        In ``w = z**-1``.
    denominators : tuple of Coefficients
        Factors of the denominator, each of a degree of at most 2 and with the constant term 1.
    """

    numerator: fmpq_poly
    denominators: tuple[Coefficients, ...]

    def all_pole(self, denominator: Coefficients) -> Response:
        """Response after ``1/denominator``; the denominator starts with 1 and has a degree of at most 2."""
        if len(denominator) == 1:
            return self
        return Response(self.numerator, (*self.denominators, denominator))

    def taps(self, numerator: Coefficients) -> Response:
        """Response after the polynomial `numerator`."""
        return Response(self.numerator * polynomial(numerator), self.denominators)

    def plus(self, other: Response) -> Response:
        """Sum of two responses."""
        under = common([self, other])
        return Response(self.over(under) + other.over(under), under)

    def minus(self, other: Response) -> Response:
        """Difference of two responses."""
        under = common([self, other])
        return Response(self.over(under) - other.over(under), under)

    def over(self, denominators: Sequence[Coefficients]) -> fmpq_poly:
        """Numerator over a multiple of the denominator."""
        missing = Counter(denominators)
        missing.subtract(self.denominators)
        return reduce(lambda product, factor: product * polynomial(factor), missing.elements(), self.numerator)

    @property
    def at_zero_frequency(self) -> Fraction:
        """Sum of all samples."""
        value = self.numerator(1)
        under = math.prod((sum(factor, Fraction(0)) for factor in self.denominators), start=Fraction(1))
        return Fraction(int(value.p), int(value.q)) / under


def common(responses: Sequence[Response]) -> tuple[Coefficients, ...]:
    """Factors of the least common denominator, in a fixed order."""
    most: Counter[Coefficients] = Counter()
    for response in responses:
        most |= Counter(response.denominators)
    return tuple(sorted(most.elements()))


IMPULSE = Response(fmpq_poly([1]), ())
"""A single sample of 1."""
