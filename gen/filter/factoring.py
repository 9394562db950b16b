"""Second-order sections of a transfer function, of zeros and poles, or of an analog prototype.

Roots are isolated in ball arithmetic, multiple ones included, paired as `scipy.signal.zpk2sos` does, and rounded once,
to doubles. An analog prototype goes through the bilinear transformation ``s = c (z - 1) / (z + 1)`` with
``c = 2 / T``, or ``c = w / tan(w T / 2)`` with a pre-warped frequency w; or its impulse response is sampled.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import cast

from flint import acb, arb, fmpq, fmpz_poly

from sosmith.gen.filter.impulse_invariance import impulse_invariant
from sosmith.gen.filter.prototypes import Prototype
from sosmith.gen.filter.sections import Root, Row, Section, paired, rounded
from sosmith.gen.specification.coefficients.content import Complex, TransferFunction, ZerosAndPoles
from sosmith.model.arithmetic.correct_rounding import ball, evaluate, nearest_double
from sosmith.model.errors import SpecificationError

_GRID = 256
"""Points from 0 to half the sample rate, both included, where responses are compared."""

_MAX_ORDER = 20

_FASTEST = 100
"""Largest pole in rad/s that can be sampled, for each Hz: its residue has died away, and takes digits to find."""


@dataclass(frozen=True)
class Factored:
    """Sections of a stated filter.

    Attributes
    ----------
    rows : tuple of Row
        (b0, b1, b2, 1, a1, a2), scipy's signs.
    deviation : float
        Largest difference between their response and the stated one, over a grid up to half the sample rate, relative
        to the largest magnitude.
    """

    rows: tuple[Row, ...]
    deviation: float


@dataclass(frozen=True)
class _Digital:
    """As many zeros as poles, in the z-plane, and the factor of the product of all ``(z - zero) / (z - pole)``."""

    zeros: list[Root]
    poles: list[Root]
    gain: arb

    def __call__(self, z: acb) -> acb:
        value = acb(self.gain)
        for roots, power in ((self.zeros, 1), (self.poles, -1)):
            for root in roots:
                factor = z - root.place
                value *= (factor if root.real else factor * (z - root.place.conjugate())) ** power
        return value


def factored(content: TransferFunction | ZerosAndPoles, sample_rate: Fraction | None = None) -> Factored:
    """Make second-order sections.

    Parameters
    ----------
    content : TransferFunction or ZerosAndPoles
    sample_rate : Fraction or None
        In Hz; an analog prototype needs it.

    Raises
    ------
    SpecificationError
        If the filter has no sections: a leading coefficient of 0, roots without their conjugates, more than 20 poles,
        more zeros than poles; or a prototype lacks its sample rate, is not stable, or cannot be sampled.

    Examples
    --------
    >>> half = Fraction(1, 2)
    >>> stated = TransferFunction(format="b and a", numerator=(half, half), denominator=(Fraction(1), -half))
    >>> factored(stated).rows
    ((0.5, 0.5, 0.0, 1.0, -0.5, 0.0),)
    """
    if isinstance(content, TransferFunction):
        _check_transfer(content)
    else:
        _check_places(content)
    if isinstance(content, ZerosAndPoles) and content.analog:
        if sample_rate is None:
            raise SpecificationError("an analog prototype must come with a sample rate in Hz, not without one")
        if content.method == "impulse_invariant":
            return evaluate(lambda: _sampled(content, sample_rate))
    return evaluate(lambda: _factored(content, sample_rate))


def _check_transfer(content: TransferFunction) -> None:
    for name, polynomial in (("b", content.numerator), ("a", content.denominator)):
        if not polynomial[0]:
            raise SpecificationError(f"{name} must begin with a nonzero number, not 0")
        if len(polynomial) > _MAX_ORDER + 1:
            raise SpecificationError(f"{name} must have at most {_MAX_ORDER + 1} numbers, not {len(polynomial)}")


def _check_places(content: ZerosAndPoles) -> None:
    if len(content.poles) > _MAX_ORDER or not content.poles:
        raise SpecificationError(f"poles must be 1 to {_MAX_ORDER}, not {len(content.poles)}")
    if len(content.zeros) > len(content.poles):
        raise SpecificationError(
            f"zeros must be at most as many as poles, {len(content.poles)}, not {len(content.zeros)}"
        )
    if not content.gain:
        raise SpecificationError("gain must be nonzero, not 0")
    for name, places in (("zeros", content.zeros), ("poles", content.poles)):
        counts = Counter(places)
        for real, imaginary in places:
            if counts[real, imaginary] != counts[real, -imaginary]:
                alone = f"{float(real):.6g}{float(imaginary):+.6g}j"
                raise SpecificationError(f"{name} must come in conjugate pairs, not {alone} without its conjugate")
    if content.analog and any(real >= 0 for real, _ in content.poles):
        raise SpecificationError("poles of an analog prototype must have negative real parts, not others")


def _factored(content: TransferFunction | ZerosAndPoles, sample_rate: Fraction | None) -> Factored:
    digital = _of_polynomials(content) if isinstance(content, TransferFunction) else _of_places(content, sample_rate)
    grid = [_on_circle(k) for k in range(_GRID + 1)]
    sizes = [nearest_double(abs(digital(z))) for z in grid]
    passing = grid[sizes.index(max(sizes))]
    sections = paired(poles=digital.poles, zeros=digital.zeros)
    rows = _signed(rounded(sections, passing, abs(digital(passing))), negative=digital.gain < 0)
    return Factored(rows, _deviation(rows, [digital(z) for z in grid]))


def _of_polynomials(content: TransferFunction) -> _Digital:
    order = max(len(content.numerator), len(content.denominator)) - 1
    zeros, poles = (_roots(polynomial, order) for polynomial in (content.numerator, content.denominator))
    return _Digital(zeros, poles, ball(content.numerator[0] / content.denominator[0]))


def _roots(polynomial: Sequence[Fraction], order: int) -> list[Root]:
    """Roots of a polynomial in 1/z, times ``z**order``."""
    common = math.lcm(*(value.denominator for value in polynomial))
    padded = [*(int(value * common) for value in polynomial), *[0] * (order + 1 - len(polynomial))]
    # The library's type stubs omit the multiplicities.
    roots = cast("list[tuple[acb, int]]", fmpz_poly(padded[::-1]).complex_roots())
    return [
        Root(root, real=root.imag.is_zero())
        for root, times in roots
        for _ in range(int(times))
        if root.imag.is_zero() or root.imag > 0
    ]


def _of_places(content: ZerosAndPoles, sample_rate: Fraction | None) -> _Digital:
    missing = len(content.poles) - len(content.zeros)
    if not content.analog:
        zeros, poles = (_upper(places, None) for places in (content.zeros, content.poles))
        return _Digital(zeros + [Root(acb(0), real=True)] * missing, poles, ball(content.gain))
    assert sample_rate is not None  # `factored` has checked it
    c = 2 * ball(sample_rate)
    if content.prewarp is not None:
        turns = content.prewarp / sample_rate
        if turns >= Fraction(1, 2):
            raise SpecificationError(f"prewarp must be below half the sample rate, not {float(content.prewarp):g} Hz")
        angle = fmpq(turns.numerator, turns.denominator)
        c = 2 * arb.pi() * ball(content.prewarp) * arb.cos_pi_fmpq(angle) / arb.sin_pi_fmpq(angle)
    gain = ball(content.gain)
    for places, power in ((content.zeros, 1), (content.poles, -1)):
        for place in places:
            if place[1] >= 0:
                factor = c - acb(ball(place[0]), ball(place[1]))
                gain *= (factor.real if place[1] == 0 else factor.real**2 + factor.imag**2) ** power
    zeros, poles = (_upper(places, c) for places in (content.zeros, content.poles))
    return _Digital(zeros + [Root(acb(-1), real=True)] * missing, poles, gain)


def _upper(places: Sequence[Complex], c: arb | None) -> list[Root]:
    """Take real places, and one of each conjugate pair; with `c`, through the bilinear transformation."""
    roots = []
    for real, imaginary in places:
        if imaginary >= 0:
            place = acb(ball(real), ball(imaginary))
            roots.append(Root(place if c is None else (c + place) / (c - place), real=imaginary == 0))
    return roots


def _sampled(content: ZerosAndPoles, sample_rate: Fraction) -> Factored:
    """Sample the impulse response of an analog prototype; the gain at 0 Hz is that of the analog sum of residues."""
    real_poles = [real for real, imaginary in content.poles if not imaginary]
    if any(real for real, _ in content.zeros) or len(content.zeros) >= len(content.poles):
        raise SpecificationError(
            "zeros of a prototype with impulse_invariant must be fewer than its poles and imaginary, not others"
        )
    if len(real_poles) > 1 or len(set(content.poles)) < len(content.poles) or any(not w for _, w in content.zeros):
        raise SpecificationError(
            "poles of a prototype with impulse_invariant must be simple, at most one of them real, and zeros not at 0, "
            "not others"
        )
    if any(max(abs(real), abs(imaginary)) > _FASTEST * sample_rate for real, imaginary in content.poles):
        raise SpecificationError(
            f"poles of a prototype with impulse_invariant must be within {_FASTEST} times the sample rate, not beyond"
        )
    # `impulse_invariant` takes poles in units of a cutoff; this one is a quarter of the sample rate.
    unit = ball(sample_rate) * arb.pi() / 2
    zeros = [ball(w) for _, w in content.zeros if w > 0]
    level = ball(content.gain)
    for places, power in ((content.zeros, 1), (content.poles, -1)):
        for real, imaginary in places:
            if imaginary >= 0:
                level *= (ball(-real) if not imaginary else ball(real**2 + imaginary**2)) ** power
    prototype = Prototype(
        zeros=tuple(w / unit for w in zeros),
        real_poles=tuple(ball(real) / unit for real in real_poles),
        pole_pairs=tuple(acb(ball(re), ball(im)) / unit for re, im in content.poles if im > 0),
        dc_gain=level,
    )
    sampled = impulse_invariant(prototype, Fraction(1, 4))
    sections, gain = sampled.sections(), sampled.level
    rows = _signed(rounded(sections, acb(1), abs(gain)), negative=gain < 0)
    grid = [_on_circle(k) for k in range(_GRID + 1)]
    exact = [_product(sections, z) * gain / _product(sections, acb(1)) for z in grid]
    return Factored(rows, _deviation(rows, exact))


def _product(sections: Sequence[Section], z: acb) -> acb:
    value = acb(1)
    for section in sections:
        (b0, b1, b2), (a0, a1, a2) = section.numerator, section.denominator
        value *= ((b0 * z + b1) * z + b2) / ((a0 * z + a1) * z + a2)
    return value


def _signed(rows: tuple[Row, ...], *, negative: bool) -> tuple[Row, ...]:
    if not negative:
        return rows
    first, *others = rows
    return ((*(-b for b in first[:3]), *first[3:]), *others)


def _deviation(rows: Sequence[Row], exact: Sequence[acb]) -> float:
    largest = max(nearest_double(abs(value)) for value in exact)
    apart = []
    for k, value in enumerate(exact):
        z = _on_circle(k)
        response = acb(1)
        for b0, b1, b2, _, a1, a2 in rows:
            response *= ((ball(b0) * z + ball(b1)) * z + ball(b2)) / ((z + ball(a1)) * z + ball(a2))
        apart.append(float(abs(response - value).upper()))
    return max(apart) / largest


def _on_circle(k: int) -> acb:
    angle = fmpq(k, _GRID)
    return acb(arb.cos_pi_fmpq(angle), arb.sin_pi_fmpq(angle))
