"""Smallest order of a low-pass prototype that meets a pass-band loss and a stop-band loss, and where its edge lies."""

from __future__ import annotations

from fractions import Fraction

from flint import arb

from sosmith.verify.bounds.l1_response import UndecidedError
from sosmith.verify.specified.analog_prototypes import discrimination, ripple_squared, selectivity


def smallest_order(
    family: str, transition: arb, passband_loss: Fraction, stopband_loss: Fraction, limit: int
) -> int | None:
    """Return the smallest order from 1 to `limit` that meets both losses, or None if no such order does.

    Parameters
    ----------
    family : str
        "butterworth", "chebyshev1", "chebyshev2" or "elliptic".
    transition : arb
        Stop-band edge over pass-band edge of the prototype, above 1.
    passband_loss, stopband_loss : Fraction
        In dB, above 0; the first is the largest loss in the pass band, the second the smallest in the stop band.
    limit : int
        Highest order that is tried.

    Raises
    ------
    UndecidedError
        If the precision is too low to tell whether an order meets them.

    Examples
    --------
    >>> smallest_order("butterworth", arb(2), Fraction(3), Fraction(20), 10)
    4
    """
    ratio = discrimination(passband_loss, stopband_loss)
    return next((order for order in range(1, limit + 1) if _meets(family, order, transition, ratio)), None)


def _meets(family: str, order: int, transition: arb, ratio: arb) -> bool:
    """Whether a filter that just meets the pass band's loss at 1 rad/s has the stop band's at `transition`."""
    match family:
        case "butterworth":
            margin = transition**order * ratio - 1
        case "chebyshev1" | "chebyshev2":
            margin = transition.chebyshev_t(order) * ratio - 1
        case _:
            margin = transition * selectivity(order, ratio).k - 1
    if margin > 0:
        return True
    if margin < 0:
        return False
    raise UndecidedError(f"whether order {order} meets the losses could not be decided")


def edge_from_passband(family: str, order: int, passband_loss: Fraction, stopband_loss: Fraction) -> arb:
    """Return the edge, as the family defines it, of the prototype that meets the pass-band loss at 1 rad/s exactly.

    Examples
    --------
    >>> abs(edge_from_passband("butterworth", 1, Fraction(10), Fraction(20)) - arb(1) / 3) < 1e-14
    True
    """
    match family:
        case "butterworth":
            return ripple_squared(passband_loss).rsqrt().root(order)
        case "chebyshev2":
            return ((1 / discrimination(passband_loss, stopband_loss)).acosh() / order).cosh()
        case _:
            return arb(1)
