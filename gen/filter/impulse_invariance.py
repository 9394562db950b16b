"""Impulse-invariant filters: ``h[n] = T h_a(n T)`` of an analog low-pass, as second-order sections.

With the analog filter in partial fractions (simple poles, more poles than zeros) [1]_::

    H_a(s) = sum of R_i / (s - p_i)   ->   H(z) = T * sum of R_i / (1 - exp(p_i T) z^-1)

The response of the analog filter above half the sample rate is aliased; `Aliasing` says by how much.

The zeros of H(z) are close to those of Euler's polynomials, and at low cutoffs the sum is smaller than its terms by
many orders of magnitude. It is therefore computed in ball arithmetic with sufficient precision.

References
----------
.. [1] A. V. Oppenheim and R. W. Schafer, Discrete-Time Signal Processing, "Filter design by impulse invariance".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from flint import acb, acb_poly, arb, ctx

from sosmith.gen.filter.prototypes import Prototype
from sosmith.gen.filter.sections import Section
from sosmith.model.arithmetic.correct_rounding import UndecidedError, ball, nearest_double

_GRID = 512
"""Points of each of the two grids on which responses are compared, one even and one logarithmic."""

_DECADES = 2
"""Decades that the logarithmic grid extends below the slowest pole."""

_UNITY = 1e-9
"""Relative distance within which the gain at zero frequency counts as one: so little aliasing does not justify extra
hardware."""


@dataclass(frozen=True, kw_only=True)
class Aliasing:
    """Deviation of an impulse-invariant filter from its analog model, up to half the sample rate.

    Attributes
    ----------
    max_deviation : float
        Largest difference of the two magnitudes, relative to the largest magnitude of the analog filter.
    dc_error : float
        Gain at zero frequency minus that of the analog filter, relative to the latter.
    """

    max_deviation: float
    dc_error: float


def impulse_invariant(prototype: Prototype, ratio: Fraction) -> Sampled:
    """Sample the impulse response of an analog low-pass.

    Parameters
    ----------
    prototype : Prototype
        More poles than zeros; poles simple, in the left half-plane, at most one of them real.
    ratio : Fraction
        Cutoff divided by the sample rate, not pre-warped.

    Raises
    ------
    ValueError
        If the poles do not outnumber the zeros.
    """
    if prototype.zeros_at_infinity < 1:
        raise ValueError(f"zeros must be fewer than the {prototype.order} poles, not {2 * len(prototype.zeros)}")
    model = _Analog.of(prototype, 2 * arb.pi() * ball(ratio))
    denominators = tuple(acb_poly([1, -pole.exp()]) for pole in model.poles)
    return Sampled(prototype, model, _numerator(model, denominators), denominators)


def simple_level(level: arb) -> arb:
    """Gain at zero frequency for the doubles that hardware is made from: one if it is as good as one."""
    return arb(1) if abs(nearest_double(level - 1)) < _UNITY else level


def aliasing(prototype: Prototype, ratio: Fraction) -> Aliasing:
    """Compare the filter of `impulse_invariant` with its analog model; parameters and errors as there."""
    sampled = impulse_invariant(prototype, ratio)
    model = sampled.model
    level = prototype.dc_gain
    dc_error = nearest_double(sampled.level / level - 1)
    slowest = _smallest([abs(pole) for pole in model.poles])
    start = _smallest([slowest / arb.pi(), arb(1)]) / 10**_DECADES  # relative to half the sample rate
    even = [arb(k) / (_GRID - 1) for k in range(_GRID)]
    worst, largest = arb(0), arb(0)
    for place in (*even, *(start ** (1 - place) for place in even)):
        angle = arb.pi() * place
        analog, digital = abs(model(acb(0, angle))), abs(sampled(acb(angle.cos(), -angle.sin())))
        worst, largest = worst.max(abs(analog - digital)), largest.max(analog)
    return Aliasing(max_deviation=nearest_double(worst / largest), dc_error=dc_error)


def _smallest(values: Sequence[arb]) -> arb:
    first, *others = values
    for value in others:
        first = first.min(value)
    return first


@dataclass(frozen=True)
class _Analog:
    """``gain * prod(s**2 + w**2) / prod(s - p)``, s in radians per sample; its edge is `scale`."""

    zeros: tuple[arb, ...]
    poles: tuple[acb, ...]
    gain: arb
    scale: arb

    @classmethod
    def of(cls, prototype: Prototype, scale: arb) -> _Analog:
        """Scale a prototype so that its edge is at `scale`."""
        zeros = tuple(zero * scale for zero in prototype.zeros)
        real = [acb(pole * scale) for pole in prototype.real_poles]
        upper = [pole * scale for pole in prototype.pole_pairs]
        poles = (*real, *upper, *(pole.conjugate() for pole in upper))
        gain = prototype.dc_gain
        for pole in poles:
            gain = (gain * -pole).real if pole.imag.is_zero() else gain * abs(pole)
        for zero in zeros:
            gain /= zero**2
        return cls(zeros, poles, gain, scale)

    def __call__(self, s: acb) -> acb:
        value = acb(self.gain)
        for zero in self.zeros:
            value *= s**2 + zero**2
        for pole in self.poles:
            value /= s - pole
        return value


@dataclass(frozen=True)
class Sampled:
    """A digital filter in ``w = z**-1``, and the analog filter whose impulse response it samples."""

    prototype: Prototype
    model: _Analog
    numerator: acb_poly
    denominators: tuple[acb_poly, ...]

    def __call__(self, w: acb) -> acb:
        value: acb = self.numerator(w)
        for denominator in self.denominators:
            value /= denominator(w)
        return value

    @property
    def level(self) -> arb:
        """The gain at zero frequency; `simple_level` is it for hardware."""
        return self(acb(1)).real

    @property
    def real_poles(self) -> list[arb]:
        """Its poles in the z-plane that are real."""
        return [(pole * self.model.scale).exp() for pole in self.prototype.real_poles]

    @property
    def pole_pairs(self) -> list[acb]:
        """One of each conjugate pair of its poles in the z-plane."""
        return [(pole * self.model.scale).exp() for pole in self.prototype.pole_pairs]

    def sections(self) -> list[Section]:
        """Return its sections; poles closest to the unit circle come last, and numerators are not scaled.

        Raises
        ------
        UndecidedError
            If the precision is too low.
        """
        groups = _zero_groups(self.numerator, delayed=self.prototype.zeros_at_infinity > 1)
        matched = []
        for pole in sorted(self.pole_pairs, key=lambda pole: nearest_double(1 - abs(pole) ** 2)):
            distances = [
                min((nearest_double(abs(zero - pole) ** 2) for zero in group.zeros), default=float("inf"))
                for group in groups
            ]
            group = groups.pop(distances.index(min(distances)))
            matched.append(_section(group, acb_poly([1, -2 * pole.real, abs(pole) ** 2])))
        single = [_section(_Group(acb_poly([1]), ()), acb_poly([1, -pole])) for pole in self.real_poles]
        return [*single, *matched[::-1]]


def _numerator(model: _Analog, denominators: Sequence[acb_poly]) -> acb_poly:
    """Numerator, whose degree is the number of poles minus one."""
    total = acb_poly([])
    for i, pole in enumerate(model.poles):
        residue = acb(model.gain)
        for zero in model.zeros:
            residue *= pole**2 + zero**2
        for j, other in enumerate(model.poles):
            if j != i:
                residue /= pole - other
        total += _product([denominator for j, denominator in enumerate(denominators) if j != i]) * residue
    return acb_poly([total[k].real for k in range(len(denominators))])


def _product(polynomials: Sequence[acb_poly]) -> acb_poly:
    result = acb_poly([1])
    for polynomial in polynomials:
        result *= polynomial
    return result


@dataclass(frozen=True)
class _Group:
    """A factor of the numerator in w, and its zeros in the z-plane."""

    factor: acb_poly
    zeros: tuple[acb, ...]


def _section(group: _Group, denominator: acb_poly) -> Section:
    first, second = (tuple(polynomial[k].real for k in range(3)) for polynomial in (group.factor, denominator))
    return Section((first[0], first[1], first[2]), (second[0], second[1], second[2]))


def _zero_groups(numerator: acb_poly, *, delayed: bool) -> list[_Group]:
    """Factors of degree 2, and one of a lower degree if necessary, up to a constant.

    Real zeros lie in nearly reciprocal pairs; the outermost are paired, which balances their coefficients. If the
    analog impulse response starts at zero, the filter has one sample of delay, which is combined with the unpaired
    zero, if any.
    """
    constant = 1 if delayed else 0
    rest = acb_poly([numerator[k] for k in range(constant, numerator.degree() + 1)])
    zeros = sorted((1 / root for root in _roots(rest)), key=_size_and_side)
    real = [zero for zero in zeros if zero.imag.is_zero()]
    groups = [_Group(acb_poly([1, -2 * zero.real, abs(zero) ** 2]), (zero,)) for zero in zeros if zero.imag > 0]
    while len(real) > 1:
        first, last = real.pop(0), real.pop()
        groups.append(_Group(acb_poly([1, -first.real]) * acb_poly([1, -last.real]), (first, last)))
    left_over = _product([acb_poly([1, -zero.real]) for zero in real])
    if delayed or real:
        groups.append(_Group(left_over * acb_poly([0, 1]) if delayed else left_over, tuple(real)))
    return groups


def _size_and_side(zero: acb) -> tuple[float, float]:
    return nearest_double(abs(zero) ** 2), nearest_double(zero.imag)


def _roots(polynomial: acb_poly) -> list[acb]:
    """Roots of a polynomial with real coefficients; real roots have an imaginary part of exactly zero.

    The balls are disjoint, so one that intersects the real axis contains the conjugate of its root: the root is real.
    """
    try:
        roots: list[acb] = polynomial.roots(tol=2.0 ** -min(ctx.prec // 2, 1000), maxprec=2 * ctx.prec)
    except ValueError as error:
        raise UndecidedError from error
    return [acb(root.real) if root.imag.contains(0) else root for root in roots]
