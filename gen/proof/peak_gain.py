"""Worst-case peak gains with a guarantee: impulse responses in integers, every rounding and the tail accounted for.

A response is computed section by section in integers with a fixed number of fraction bits; after each recursion
and each set of taps the result is rounded down once. Two bounds make sums over it rigorous.

Rounding: an error of one unit entering an all-pole section 1/D comes out as at most ``L1(1/D)`` units, and
``L1(1/D) <= prod 1/(1 - |p|)`` over its poles; taps N multiply an error by at most ``sum |n_k|``.

Tail: for any rho with ``|p| rho < 1`` for all poles, ``|h_k| <= M rho**-k`` with
``M = prod sum |n_k| rho**k / prod (1 - |p| rho)`` (Cauchy's estimate on the circle |w| = rho, w = z**-1).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from sosmith.model.errors import ShortfallError

Coefficients = tuple[Fraction, ...]
"""Of a polynomial in ``w = z**-1``, dyadic, the constant term first."""

_RELATIVE_BITS = 40  # approximate relative accuracy of a sum
_LONGEST = 1 << 20  # samples of a response
_ROOT_BITS = 80  # fraction bits that pole radii are rounded up to


@dataclass(frozen=True)
class Horizon:
    """Length and resolution at which responses are computed.

    Attributes
    ----------
    length : int
        Samples.
    bits : int
        Fraction bits of a sample.
    rho : Fraction
        Radius of Cauchy's estimate, above 1.
    """

    length: int
    bits: int
    rho: Fraction


def horizon(paths: Iterable[Iterable[Coefficients]]) -> Horizon:
    """Choose a horizon for responses through any of `paths`, each given by its denominators.

    Raises
    ------
    ShortfallError
        If a pole does not lie inside the unit circle, or a response lasts longer than a million samples.
    """
    radii = [[radius for denominator in path for radius in pole_radii(denominator)] for path in paths]
    largest = max((radius for path in radii for radius in path), default=Fraction(0))
    if largest >= 1:
        raise ShortfallError("every pole must lie inside the unit circle, and one does not")
    # log(rho) is nine tenths of its limit, which the slowest pole sets.
    decay = 4.0 if largest < Fraction(1, 64) else -math.log(largest)
    rho = _rounded_down(Fraction(math.exp(0.9 * decay)))
    log_magnitude = max(-sum(math.log2(1 - radius * rho) for radius in path) for path in radii)
    log_rounding = max(-sum(math.log2(1 - radius) for radius in path) for path in radii)
    # A tail is rho**-length / (1 - 1/rho) of the magnitude.
    wanted = log_magnitude + _RELATIVE_BITS - math.log2(1 - 1 / rho)
    length = 64 + math.ceil(wanted / math.log2(rho))
    if length > _LONGEST:
        raise ShortfallError(
            f"the impulse response must end within {_LONGEST} samples, not {length}: a pole lies too close to the unit "
            "circle"
        )
    return Horizon(length, math.ceil(log_rounding + math.log2(length)) + _RELATIVE_BITS + 16, rho)


@dataclass(frozen=True)
class Response:
    """An impulse response with bounds on its inexactness.

    Attributes
    ----------
    horizon : Horizon
    samples : list of int
        In units of ``2**-bits``.
    rounding : Fraction
        Every sample is within this many units of the exact one.
    magnitude : Fraction
        ``|h_k| <= magnitude * rho**-k`` for the exact response.
    """

    horizon: Horizon
    samples: list[int]
    rounding: Fraction
    magnitude: Fraction

    def all_pole(self, denominator: Coefficients) -> Response:
        """Response after ``1/denominator``; the denominator starts with 1 and has a degree of at most 2."""
        gain = growth = Fraction(1)
        for radius in pole_radii(denominator):
            gain /= 1 - radius
            growth /= 1 - radius * self.horizon.rho
        shift, (_, *weights) = _integers(denominator)
        return Response(
            self.horizon,
            _recursion(self.samples, weights, shift),
            _rounded_up((self.rounding + 1) * gain),
            _rounded_up(self.magnitude * growth),
        )

    def taps(self, numerator: Coefficients) -> Response:
        """Response after the polynomial `numerator`."""
        size = sum((abs(n) for n in numerator), Fraction(0))
        growth = sum((abs(n) * self.horizon.rho**k for k, n in enumerate(numerator)), Fraction(0))
        shift, weights = _integers(numerator)
        return Response(
            self.horizon,
            _weighted(self.samples, weights, shift),
            _rounded_up(self.rounding * size + 1),
            _rounded_up(self.magnitude * growth),
        )

    def plus(self, other: Response) -> Response:
        """Sum of two responses over the same horizon."""
        return Response(
            self.horizon,
            [a + b for a, b in zip(self.samples, other.samples, strict=True)],
            self.rounding + other.rounding,
            self.magnitude + other.magnitude,
        )

    def minus(self, other: Response) -> Response:
        """Difference of two responses over the same horizon."""
        return Response(
            self.horizon,
            [a - b for a, b in zip(self.samples, other.samples, strict=True)],
            self.rounding + other.rounding,
            self.magnitude + other.magnitude,
        )

    @property
    def uncertainty(self) -> Fraction:
        """Bound on the error of the sum of the samples' magnitudes: rounding and tail."""
        return self.rounding * self.horizon.length / (1 << self.horizon.bits) + self.tail

    @property
    def tail(self) -> Fraction:
        """Bound on the sum of ``|h_k|`` over all k beyond the samples."""
        h = self.horizon
        return self.magnitude * _power_above(1 / h.rho, h.length) / (1 - 1 / h.rho)


def impulse(at: Horizon) -> Response:
    """Response without any filter: a single sample of 1."""
    return Response(at, [1 << at.bits] + [0] * (at.length - 1), Fraction(0), Fraction(1))


@dataclass(frozen=True)
class Drive:
    """A response and the range of what drives it, at every sample from reset on."""

    response: Response
    low: Fraction
    high: Fraction


@dataclass(frozen=True)
class Extent:
    """Proven limits of a sum of driven responses: never below `low`, never above `high`, at any sample."""

    low: Fraction
    high: Fraction

    @property
    def magnitude(self) -> Fraction:
        """Largest absolute value."""
        return max(-self.low, self.high)


def extent(drives: Sequence[Drive]) -> Extent:
    """Limits of the sum of `drives`, all of which are zero before reset.

    The upper limit is the maximum over all n of ``sum over drives of sum over k <= n of max(h_k low, h_k high)``, and
    the lower limit likewise. Intervals that are not symmetric about zero are used as they are, and drives may cancel
    at each n.
    """
    live = [drive for drive in drives if drive.low or drive.high]
    if not live:
        return Extent(Fraction(0), Fraction(0))
    unit, rises, falls = _steps(live)
    tops, bottoms = np.cumsum(rises), np.cumsum(falls)
    steps = len(rises) * len(live)  # each rounded outward by less than one unit
    slack = sum((max(abs(d.low), abs(d.high)) * d.response.uncertainty for d in live), Fraction(0))
    low, high = min(int(bottoms.min()), 0), max(int(tops.max()), 0)
    return Extent((low - steps) * unit - slack, (high + steps) * unit + slack)


def _steps(drives: Sequence[Drive]) -> tuple[Fraction, npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Largest and smallest contribution of all drives together at each delay, as integers of a common unit.

    The unit is chosen so that their running sums stay within 64 bits; its effect on the result is negligible.
    """
    bits, length = drives[0].response.horizon.bits, len(drives[0].response.samples)
    peak = sum(
        (max(abs(d.low), abs(d.high)) * max(map(abs, d.response.samples)) for d in drives),
        Fraction(0),
    )
    room = 61 - length.bit_length()  # for the sum over all drives at one delay
    drop = max(0, math.ceil(peak).bit_length() - room)
    rises, falls = np.zeros(length, dtype=np.int64), np.zeros(length, dtype=np.int64)
    for drive in drives:
        scale = max(_fraction_bits(drive.low), _fraction_bits(drive.high))
        low, high, shift = int(drive.low * (1 << scale)), int(drive.high * (1 << scale)), scale + drop
        values = drive.response.samples
        rises += np.array([(v * high if v >= 0 else v * low) >> shift for v in values], dtype=np.int64)
        falls += np.array([(v * low if v >= 0 else v * high) >> shift for v in values], dtype=np.int64)
    return Fraction(1 << drop, 1 << bits), rises, falls


def peak_gain(sections: Sequence[tuple[Coefficients, Coefficients]]) -> Fraction:
    """Upper bound of the worst-case peak gain ``sum |h_k|`` of a product of sections (numerator, denominator).

    It exceeds the exact value by a relative amount in the order of ``2**-40``.
    """
    response = impulse(horizon([[denominator for _, denominator in sections]]))
    for numerator, denominator in sections:
        response = response.all_pole(denominator).taps(numerator)
    return extent([Drive(response, Fraction(-1), Fraction(1))]).high


def pole_radii(denominator: Coefficients) -> list[Fraction]:
    """Upper bounds of the poles' radii, above them by less than ``2**-79``.

    Raises
    ------
    ValueError
        If the degree exceeds 2.
    """
    if len(denominator) == 1:
        return []
    if len(denominator) == 2:
        return [abs(denominator[1])]
    if len(denominator) > 3:
        raise ValueError(f"denominator must have a degree of at most 2, not {len(denominator) - 1}")
    _, a1, a2 = denominator
    discriminant = a1 * a1 - 4 * a2
    if discriminant < 0:
        return [_root_above(a2)] * 2
    root = _root_above(discriminant)
    least = max(root - Fraction(1, 1 << _ROOT_BITS), Fraction(0))
    return [(abs(a1) + root) / 2, max(abs(abs(a1) - root), abs(abs(a1) - least)) / 2]


def _recursion(samples: list[int], weights: list[int], shift: int) -> list[int]:
    if not weights:
        return samples
    d1, d2 = weights[0], weights[1] if len(weights) > 1 else 0
    result = []
    y1 = y2 = 0
    for value in samples:
        y1, y2 = ((value << shift) - d1 * y1 - d2 * y2) >> shift, y1
        result.append(y1)
    return result


def _weighted(samples: list[int], weights: list[int], shift: int) -> list[int]:
    """Convolution with a few taps, as long as the samples, rounded down once."""
    if len(weights) == 1:
        (w0,) = weights
        return [(w0 * a) >> shift for a in samples]
    if len(weights) == 2:
        w0, w1 = weights
        return [(w0 * a + w1 * b) >> shift for a, b in zip(samples, [0, *samples], strict=False)]
    w0, w1, w2, *rest = weights
    delayed = zip(samples, [0, *samples], [0, 0, *samples], strict=False)
    if not rest:
        return [(w0 * a + w1 * b + w2 * c) >> shift for a, b, c in delayed]
    total = [w0 * a + w1 * b + w2 * c for a, b, c in delayed]
    for delay, weight in enumerate(rest, start=3):
        total = [t + weight * a for t, a in zip(total, [0] * delay + samples, strict=False)]
    return [value >> shift for value in total]


def _integers(coefficients: Coefficients) -> tuple[int, list[int]]:
    """Return the common fraction bits and the coefficients as integers."""
    shift = max(_fraction_bits(c) for c in coefficients)
    return shift, [int(c * (1 << shift)) for c in coefficients]


def _fraction_bits(value: Fraction) -> int:
    bits = value.denominator.bit_length() - 1
    if value.denominator != 1 << bits:
        raise ValueError(f"value must be dyadic, not {value}")
    return bits


def _root_above(value: Fraction) -> Fraction:
    """Square root rounded up to a multiple of ``2**-80``."""
    scaled = -(-value.numerator * (1 << (2 * _ROOT_BITS)) // value.denominator)
    root = math.isqrt(scaled)
    return Fraction(root + (root * root < scaled), 1 << _ROOT_BITS)


def _power_above(base: Fraction, exponent: int) -> Fraction:
    """``base**exponent`` for 0 < base < 1, rounded up."""
    one = 1 << 256
    value, square = one, -(-base.numerator * one // base.denominator)
    while exponent:
        if exponent & 1:
            value = -(-value * square // one)
        square = -(-square * square // one)
        exponent >>= 1
    return Fraction(value, one)


def _rounded_up(value: Fraction) -> Fraction:
    """`value` rounded up to about 64 significant bits, to keep numbers short."""
    scale = Fraction(2) ** (value.denominator.bit_length() - value.numerator.bit_length() + 64)
    return Fraction(math.ceil(value * scale)) / scale


def _rounded_down(value: Fraction) -> Fraction:
    scale = 1 << 60
    return Fraction(math.floor(value * scale), scale)
