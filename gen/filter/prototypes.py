"""Analog prototypes: low-pass filters with their edge at 1 rad/s, in ball arithmetic.

References
----------
.. [1] T. W. Parks and C. S. Burrus, Digital Filter Design, chapter 7: Butterworth, Chebyshev and elliptic filters.
.. [2] S. J. Orfanidis, Lecture Notes on Elliptic Filter Design: the degree equation by nomes.
.. [3] F. W. J. Olver et al., NIST Digital Library of Mathematical Functions, sections 20.2, 22.2 and 19.25.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import cast

from flint import acb, arb, fmpq, fmpz_poly

from sosmith.model.arithmetic.correct_rounding import ball


@dataclass(frozen=True, kw_only=True)
class Prototype:
    """Analog low-pass filter with its edge at 1 rad/s.

    Attributes
    ----------
    zeros : tuple of arb
        Positive frequencies in rad/s: each stands for a pair of zeros on the imaginary axis.
    real_poles : tuple of arb
        Negative; at most one.
    pole_pairs : tuple of acb
        The pole with the positive imaginary part of each conjugate pair.
    dc_gain : arb
        Gain at zero frequency.
    """

    zeros: tuple[arb, ...]
    real_poles: tuple[arb, ...]
    pole_pairs: tuple[acb, ...]
    dc_gain: arb

    @property
    def order(self) -> int:
        """Number of poles."""
        return len(self.real_poles) + 2 * len(self.pole_pairs)

    @property
    def zeros_at_infinity(self) -> int:
        """Number of poles minus number of finite zeros."""
        return self.order - 2 * len(self.zeros)


def prototype(family: str, order: int, passband_loss: Fraction | None, stopband_loss: Fraction | None) -> Prototype:
    """Make the prototype of a family.

    Parameters
    ----------
    family : str
        butterworth, chebyshev1, chebyshev2, elliptic or bessel. The edge is that of the pass band, at the given loss,
        for chebyshev1 and elliptic; that of the stop band for chebyshev2; at half power for the others.
    order : int
        Number of poles, at least 1.
    passband_loss, stopband_loss : Fraction or None
        dB; given if the family has ripples there.
    """
    passband, stopband = (None if loss is None else ripple(loss) for loss in (passband_loss, stopband_loss))
    match family, passband, stopband:
        case "butterworth", _, _:
            return _butterworth(order)
        case "bessel", _, _:
            return _bessel(order)
        case "chebyshev1", arb(), _:
            return _chebyshev1(order, passband)
        case "chebyshev2", _, arb():
            return _chebyshev2(order, stopband)
        case "elliptic", arb(), arb():
            return _elliptic(order, passband, stopband)
        case _:
            raise ValueError(f"family must be one that these losses suit, not {family}")


def ripple(loss: Fraction) -> arb:
    """Ripple factor epsilon for a loss in dB: the power gain is ``1 / (1 + epsilon**2)``."""
    return excess(loss).sqrt()


def excess(loss: Fraction) -> arb:
    """Square of `ripple`, without cancellation for small losses."""
    return (ball(loss / 10) * arb(10).log()).expm1()


def _angles(order: int) -> list[fmpq]:
    """Angles of the Butterworth poles from the negative real axis, in units of pi, largest first."""
    return [fmpq(k, 2 * order) for k in range(order - 1, 0, -2)]


def _butterworth(order: int) -> Prototype:
    return Prototype(
        zeros=(),
        real_poles=(arb(-1),) * (order % 2),
        pole_pairs=tuple(acb(-arb.cos_pi_fmpq(angle), arb.sin_pi_fmpq(angle)) for angle in _angles(order)),
        dc_gain=arb(1),
    )


def _chebyshev1(order: int, epsilon: arb) -> Prototype:
    real, pairs = _on_ellipse(order, epsilon)
    gain = arb(1) if order % 2 else (1 + epsilon**2).rsqrt()
    return Prototype(zeros=(), real_poles=real, pole_pairs=pairs, dc_gain=gain)


def _chebyshev2(order: int, epsilon: arb) -> Prototype:
    real, pairs = _on_ellipse(order, 1 / epsilon)
    return Prototype(
        zeros=tuple(1 / arb.sin_pi_fmpq(angle) for angle in _angles(order)),
        real_poles=tuple(1 / pole for pole in real),
        pole_pairs=tuple((1 / pole).conjugate() for pole in pairs),
        dc_gain=arb(1),
    )


def _on_ellipse(order: int, epsilon: arb) -> tuple[tuple[arb, ...], tuple[acb, ...]]:
    """Poles of a Chebyshev filter: the Butterworth poles moved onto an ellipse."""
    mu = (1 / epsilon).asinh() / order
    short, long = mu.sinh(), mu.cosh()
    pairs = (acb(-short * arb.cos_pi_fmpq(angle), long * arb.sin_pi_fmpq(angle)) for angle in _angles(order))
    return (-short,) * (order % 2), tuple(pairs)


def _elliptic(order: int, passband: arb, stopband: arb) -> Prototype:
    """Elliptic filter; Jacobian elliptic functions are computed as quotients of theta functions.

    With the modulus ``k1 = epsilon_p / epsilon_s`` of the ripples, the degree equation gives the frequencies' nome by
    ``tau = i K1' / (N K1)``. For ``u = j / N`` the zeros lie at ``1 / (k sn(u K))`` and the poles at
    ``i sn((u + i v) K)``, with ``v = F(atan(1 / epsilon_p), 1 - k1**2) / (N K1)``.
    """
    k1 = passband / stopband
    complement = (1 - k1**2).sqrt()
    tau = acb(0, complement.agm(1) / k1.agm(1) / order)  # K1 = pi / (2 agm(1, complement))
    # F(phi, m) = sin(phi) R_F(cos(phi)**2, 1 - m sin(phi)**2, 1), with tan(phi) = 1 / epsilon_p and 1 - m = k1**2
    square = 1 / (1 + passband**2)  # sin(phi)**2
    integral = acb.elliptic_rf(acb(1 - square), acb(1 - square + k1**2 * square), acb(1)).real * square.sqrt()
    v = integral * 2 * complement.agm(1) / (arb.pi() * order)
    _, second, third, _ = acb.modular_theta(acb(0), tau)

    def sine(z: acb) -> acb:
        """``sqrt(k) sn(2 z K)``, and k = (second / third)**2."""
        first, _, _, fourth = acb.modular_theta(z, tau)
        return first / fourth

    root = second / third  # of k
    return Prototype(
        zeros=tuple((1 / (root * sine(acb(arb(angle))))).real for angle in _angles(order)),
        real_poles=((acb(0, 1) * sine(acb(0, v / 2)) / root).real,) * (order % 2),
        pole_pairs=tuple(acb(0, 1) * sine(acb(arb(angle), v / 2)) / root for angle in _angles(order)),
        dc_gain=arb(1) if order % 2 else (1 + passband**2).rsqrt(),
    )


def _bessel(order: int) -> Prototype:
    """Bessel filter: the reverse Bessel polynomial, scaled to half power at 1 rad/s."""
    coefficients = [
        math.factorial(2 * order - k) // (2 ** (order - k) * math.factorial(k) * math.factorial(order - k))
        for k in range(order + 1)
    ]
    # |theta(i w)|**2 = even(x)**2 + x odd(x)**2 with x = w**2 rises from theta(0)**2 on
    even = fmpz_poly([(-1) ** (k // 2) * c for k, c in enumerate(coefficients) if k % 2 == 0])
    odd = fmpz_poly([(-1) ** (k // 2) * c for k, c in enumerate(coefficients) if k % 2])
    power = even * even + fmpz_poly([0, 1]) * odd * odd - 2 * coefficients[0] ** 2
    (edge,) = (root.real.sqrt() for root in _roots(power) if root.imag.is_zero() and root.real > 0)
    poles = [root / edge for root in _roots(fmpz_poly(coefficients))]
    return Prototype(
        zeros=(),
        real_poles=tuple(pole.real for pole in poles if pole.imag.is_zero()),
        pole_pairs=tuple(pole for pole in poles if pole.imag > 0),
        dc_gain=arb(1),
    )


def _roots(polynomial: fmpz_poly) -> list[acb]:
    # The library's type stubs omit the multiplicities; both polynomials have simple roots.
    return [root for root, _ in cast("list[tuple[acb, int]]", polynomial.complex_roots())]
