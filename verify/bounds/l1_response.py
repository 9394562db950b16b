"""Impulse responses with a proven error in the sum of absolute values, by an approximate inverse.

Sequences whose absolute values have a finite sum form an algebra under convolution with that sum, ``|.|``, as its
norm. Let D be a polynomial in ``w = z**-1`` and h any finite sequence, however it was found. If the residual
``E = D h - 1`` has ``|E| < 1`` then ``1/D = h / (1 + E)``, and so

    |1/D - h| <= |h| |E| / (1 - |E|).

E is one exact product of integer polynomials. It contains all rounding and truncation of h. No poles need to be
located, and if the bound exists, the recursion is stable.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice
from operator import mul

from flint import fmpq, fmpq_poly, fmpz_poly

BITS = 176
"""Fraction bits of a response's samples."""

_ERROR_BITS = 136  # an inverse is within 2**-136
_BITS_PER_POLE = 24  # a pole at 1 - 2**-24 would ring beyond the longest response
LONGEST = 1 << 21
"""Samples of the longest inverse."""

_BLOCK = 256  # samples between checks of whether a response has decayed


class UndecidedError(ArithmeticError):
    """The arithmetic used here is too coarse to tell."""


@dataclass(frozen=True)
class Inverse:
    """``1/D`` as ``samples * 2**-bits`` with an error whose absolute values sum to at most `error`."""

    samples: fmpz_poly
    bits: int
    error: Fraction


@dataclass(frozen=True)
class Response:
    """An impulse response as ``samples * 2**-BITS`` with an error whose absolute values sum to at most `error`."""

    samples: list[int]
    error: Fraction

    @property
    def gain(self) -> Fraction:
        """Upper bound of the sum of the absolute values: the worst-case peak gain."""
        return Fraction(sum(map(abs, self.samples)), 1 << BITS) + self.error


def fraction(value: fmpq) -> Fraction:
    """Convert a rational of FLINT to a Fraction."""
    return Fraction(int(value.p), int(value.q))


def is_stable(denominator: fmpq_poly) -> bool:
    """Whether all zeros lie outside the closed unit disk of w, by the Schur-Cohn recursion in rationals."""
    p = denominator.coeffs()
    while len(p) > 1:
        if not abs(p[-1]) < abs(p[0]):
            return False
        reflection = p[-1] / p[0]
        p = [a - reflection * b for a, b in zip(p[:-1], p[:0:-1], strict=True)]
    return bool(p)


def inverse(denominator: fmpq_poly, longest: int = LONGEST) -> Inverse:
    """Invert a polynomial with the constant term 1 and coefficients in binary fractions.

    Raises
    ------
    UndecidedError
        If the inverse does not decay within about `longest` samples, or a coefficient is not a binary fraction.
    """
    shift = _fraction_bits(denominator)
    bits = _ERROR_BITS + 64 + _BITS_PER_POLE * denominator.degree()
    samples = fmpz_poly(_divided([int(c) for c in denominator.numer().coeffs()], shift, bits, longest))
    one = 1 << (shift + bits)
    residual = Fraction(int(sum(map(abs, (denominator.numer() * samples - one).coeffs()))), one)
    norm = Fraction(int(sum(map(abs, samples.coeffs()))), 1 << bits)
    error = norm * residual / (1 - residual) if residual < 1 else None
    if error is None or error > Fraction(1, 1 << _ERROR_BITS):
        raise UndecidedError("the inverse of a denominator could not be enclosed")
    return Inverse(samples, bits, error)


def _divided(numerators: list[int], shift: int, bits: int, longest: int) -> list[int]:
    """Divide 1 by a polynomial until the remainder is small enough; the proof does not depend on its accuracy."""
    weights = [-value for value in numerators[1:]]
    size = 1 + (sum(map(abs, weights)) >> shift)
    line = [0] * len(weights)
    result = [1 << bits]
    line[:1] = result[: len(line)]
    norm = 1 << bits
    while max(map(abs, line), default=0) * len(line) * size * norm >> (2 * bits - _ERROR_BITS - 2):
        if len(result) > longest:
            raise UndecidedError(f"a response does not die away within {longest} samples")
        block = list(islice(_recursion(weights, shift, line), _BLOCK))
        norm += sum(map(abs, block))
        result += block
    return result


def _recursion(weights: list[int], shift: int, line: list[int]) -> Iterator[int]:
    while True:
        value = sum(map(mul, weights, line)) >> shift
        line.insert(0, value)
        line.pop()
        yield value


def response(numerator: fmpq_poly, over: Inverse) -> Response:
    """Return the response of ``numerator / D``, given the inverse of D."""
    shift = _fraction_bits(numerator) + over.bits - BITS
    samples = [int(value) >> shift for value in (numerator.numer() * over.samples).coeffs()]
    norm = sum((abs(fraction(value)) for value in numerator.coeffs()), Fraction(0))
    return Response(samples, norm * over.error + Fraction(len(samples), 1 << BITS))


def _fraction_bits(polynomial: fmpq_poly) -> int:
    scale = int(polynomial.denom())
    if scale & (scale - 1):
        raise UndecidedError("a coefficient is no binary fraction")
    return scale.bit_length() - 1
