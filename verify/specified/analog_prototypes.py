"""Analog low-pass prototypes with their edge at 1 rad/s, in ball arithmetic.

The edge is the half-power frequency of Butterworth and Bessel filters, the end of the pass band of Chebyshev I and
elliptic filters, and the beginning of the stop band of Chebyshev II filters. A loss in dB stands for the ripple
``e**2 = 10**(loss / 10) - 1``: a magnitude of ``1 / sqrt(1 + e**2)`` is that loss.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any

from flint import acb, arb, fmpq, fmpz_poly

from sosmith.verify.specified.balls import ball
from sosmith.verify.specified.elliptic_functions import Modulus, inverse_sn, sn


@dataclass(frozen=True)
class AnalogPrototype:
    """A transfer function ``H(s) = gain * prod(1 - s / zero) / prod(1 - s / pole)``.

    Attributes
    ----------
    zeros, poles : sequence of acb
        In rad/s; all finite zeros, none of them at 0, and all poles, each once.
    gain : arb
        Gain at zero frequency.
    """

    zeros: Sequence[acb]
    poles: Sequence[acb]
    gain: arb


def analog_prototype(
    family: str, order: int, passband_loss: Fraction | None = None, stopband_loss: Fraction | None = None
) -> AnalogPrototype:
    """Enclose a prototype at the precision of the context.

    Parameters
    ----------
    family : str
        "butterworth", "chebyshev1", "chebyshev2", "elliptic" or "bessel".
    order : int
        Number of poles, at least 1.
    passband_loss, stopband_loss : Fraction, optional
        In dB, above 0, the first below the second; only those that the family's ripples need are used.

    Raises
    ------
    UndecidedError
        If the precision is too low for an elliptic filter.

    Examples
    --------
    >>> pole = analog_prototype("butterworth", 1).poles[0]
    >>> abs(pole + 1) < 1e-14
    True
    """
    return _FAMILIES[family](order, passband_loss, stopband_loss)


def ripple_squared(loss: Fraction | None) -> arb:
    """Return ``e**2 = 10**(loss / 10) - 1`` for a loss in dB, above 0.

    >>> ripple_squared(Fraction(10)).contains(9)
    True
    """
    assert loss is not None  # whoever knows the family has seen to it
    return (ball(loss / 10) * arb(10).log()).expm1()


def discrimination(passband_loss: Fraction | None, stopband_loss: Fraction | None) -> arb:
    """Return the ratio of the ripples of pass band and stop band, in 0..1.

    >>> discrimination(Fraction(10), Fraction(20)) < 0.302
    True
    """
    return (ripple_squared(passband_loss) / ripple_squared(stopband_loss)).sqrt()


def selectivity(order: int, ratio: arb) -> Modulus:
    """Solve the degree equation of elliptic filters: pass-band edge over stop-band edge, as a modulus.

    With l' the complement of the discrimination `ratio`, L' its quarter period and ``u_i = (2 i - 1) / order``,

        k' = l'**order * prod(sn(u_i L', l')**4 for i = 1 .. order // 2).

    Raises
    ------
    UndecidedError
        If the precision is too low to tell the edges apart.

    Examples
    --------
    >>> abs(selectivity(1, arb(0.1)).k - 0.1) < 1e-13
    True
    """
    turned = Modulus(((1 - ratio) * (1 + ratio)).sqrt(), ratio)
    complement = turned.k**order
    for u in _odd_fractions(order):
        complement *= sn(u, turned) ** 4
    return Modulus(((1 - complement) * (1 + complement)).sqrt(), complement)


def _odd_fractions(order: int) -> list[arb]:
    """Return ``(2 i - 1) / order`` for i = 1 .. order // 2."""
    return [arb(fmpq(2 * i - 1, order)) for i in range(1, order // 2 + 1)]


def _pairs(real_parts: Sequence[arb], imaginary_parts: Sequence[arb]) -> list[acb]:
    return [acb(x, y * sign) for x, y in zip(real_parts, imaginary_parts, strict=True) for sign in (1, -1)]


def _on_ellipse(order: int, width: arb, height: arb) -> list[acb]:
    """Left half of the points at the odd multiples of ``pi / (2 order)`` on an ellipse, from its imaginary axis on."""
    angles = [u / 2 for u in _odd_fractions(order)]
    points = _pairs([-width * u.sin_pi() for u in angles], [height * u.cos_pi() for u in angles])
    return points + [acb(-width)] * (order % 2)


def _butterworth(order: int, _pass: Fraction | None, _stop: Fraction | None) -> AnalogPrototype:
    return AnalogPrototype([], _on_ellipse(order, arb(1), arb(1)), arb(1))


def _chebyshev_poles(order: int, ripple: arb) -> list[acb]:
    """Poles of the magnitude ``1 / sqrt(1 + ripple**2 T(w)**2)`` with T the Chebyshev polynomial."""
    root = ((1 + (1 + ripple**2).sqrt()) / ripple).root(order)
    return _on_ellipse(order, (root - 1 / root) / 2, (root + 1 / root) / 2)


def _rippled_gain(order: int, ripple_squared: arb) -> arb:
    """Gain at zero frequency of a pass band with ripples: their top for an odd order, their bottom for an even one."""
    return arb(1) if order % 2 else (1 + ripple_squared).rsqrt()


def _chebyshev1(order: int, passband_loss: Fraction | None, _stop: Fraction | None) -> AnalogPrototype:
    square = ripple_squared(passband_loss)
    return AnalogPrototype([], _chebyshev_poles(order, square.sqrt()), _rippled_gain(order, square))


def _chebyshev2(order: int, _pass: Fraction | None, stopband_loss: Fraction | None) -> AnalogPrototype:
    # 1 - |H|**2 at 1/w is the |H|**2 of a Chebyshev I filter with the inverse ripple.
    poles = [1 / pole for pole in _chebyshev_poles(order, ripple_squared(stopband_loss).rsqrt())]
    zeros = [1 / (u / 2).cos_pi() for u in _odd_fractions(order)]
    return AnalogPrototype(_pairs([arb(0)] * len(zeros), zeros), poles, arb(1))


def _elliptic(order: int, passband_loss: Fraction | None, stopband_loss: Fraction | None) -> AnalogPrototype:
    square, ratio = ripple_squared(passband_loss), discrimination(passband_loss, stopband_loss)
    modulus = selectivity(order, ratio)
    turned = Modulus(((1 - ratio) * (1 + ratio)).sqrt(), ratio)
    # The real pole of an odd order is at -sc(t K', k') with the t that gives sc(t L', l') = 1 / e.
    sine = sn(inverse_sn((1 + square).rsqrt(), turned), modulus.turned)
    sigma = (sine**2 / ((1 - sine) * (1 + sine))).sqrt()
    # The zeros of the rational function, cd(u_i K, k), and from them the poles by the addition theorem.
    points = [sn(1 - u, modulus) for u in _odd_fractions(order)]
    k = modulus.k
    scales = [1 + (k * sigma * x) ** 2 for x in points]
    across = [((1 - x**2) * (1 - (k * x) ** 2)).sqrt() for x in points]
    along = ((1 + sigma**2) * (1 + (k * sigma) ** 2)).sqrt()
    poles = _pairs(
        [-sigma * y / scale for y, scale in zip(across, scales, strict=True)],
        [along * x / scale for x, scale in zip(points, scales, strict=True)],
    )
    zeros = _pairs([arb(0)] * len(points), [1 / (k * x) for x in points])
    return AnalogPrototype(zeros, poles + [acb(-sigma)] * (order % 2), _rippled_gain(order, square))


def _bessel(order: int, _pass: Fraction | None, _stop: Fraction | None) -> AnalogPrototype:
    below, polynomial = fmpz_poly([1]), fmpz_poly([1, 1])
    for n in range(2, order + 1):
        below, polynomial = polynomial, (2 * n - 1) * polynomial + fmpz_poly([0, 0, 1]) * below
    edge = _half_power(polynomial)
    return AnalogPrototype([], [pole / edge for pole in _roots(polynomial)], arb(1))


def _roots(polynomial: fmpz_poly) -> list[acb]:
    """Roots of a polynomial without multiple ones; those that are real have no imaginary part."""
    pairs: Any = polynomial.complex_roots()  # pairs of root and multiplicity, which FLINT's types do not say
    return [root for root, _ in pairs]


def _half_power(polynomial: fmpz_poly) -> arb:
    """Frequency at which the squared magnitude of a reverse Bessel polynomial is twice that at zero.

    In powers of the squared frequency, the squared magnitude has positive coefficients only. Less twice its first one,
    it has one change of sign, and by Descartes' rule one positive root.
    """
    c = [int(value) for value in polynomial.coeffs()]
    even = fmpz_poly([(-1) ** i * value for i, value in enumerate(c[::2])])
    odd = fmpz_poly([(-1) ** i * value for i, value in enumerate(c[1::2])])
    power = even**2 + fmpz_poly([0, 1]) * odd**2
    coefficients = [int(value) for value in (power - 2 * c[0] ** 2).coeffs()]
    assert sum(a * b < 0 for a, b in pairwise(coefficients)) == 1
    assert all(coefficients)
    (root,) = (root.real for root in _roots(fmpz_poly(coefficients)) if root.imag.is_zero() and root.real > 0)
    return root.sqrt()


_FAMILIES: dict[str, Callable[[int, Fraction | None, Fraction | None], AnalogPrototype]] = {
    "butterworth": _butterworth,
    "chebyshev1": _chebyshev1,
    "chebyshev2": _chebyshev2,
    "elliptic": _elliptic,
    "bessel": _bessel,
}
