"""Products that drop bits before they are added up, so that the sums behind them are short.

What FLOOR drops is never negative: half a unit on average, which would have to be added again. Instead, half of the
products are floored, and the others rounded up, as ``-floor(-c x)``, which takes off what the first ones would add::

    x --+-- * c1 -- floor --> + ---> c1 x + c2 x, which is a unit too large or too small at most, and right on average
        |                     ^ -
        +-- * -c2 - floor ----+

>>> directions([5, 7, -3, 9])
[1, -1, 1, -1]

A constant that is a little longer than a multiplier block takes is two: a long one for the block, with zeros below, and
the small rest. Both products drop bits, so that that by the rest can be added to something else first.

>>> factors(783785, 18)
(97973, 3, 1)
"""

from __future__ import annotations

from collections.abc import Sequence

from sosmith.model.dataflow.adder_graph import signed_digits
from sosmith.model.dataflow.graph import GraphBuilder, Wire


def directions(coefficients: Sequence[int]) -> list[int]:
    """Return for each product 1 if it is floored, and -1 if it is rounded up; the first ones add up to 0 or nearly.

    If either will do, the constant of a product is positive.
    """
    balance = 0
    chosen = []
    for coefficient in coefficients:
        wanted = 1 if coefficient > 0 else -1
        chosen.append(wanted if abs(balance + wanted) <= 1 else -wanted)
        balance += chosen[-1]
    return chosen


def factors(constant: int, bits: int) -> tuple[int, int, int]:
    """Write a constant as ``upper * 2**dropped + rest`` with few digits in `rest`; a block of `bits` takes `upper`."""
    dropped = max(0, abs(constant).bit_length() - (bits - 1))
    below = constant >> dropped
    fitting = [upper for upper in (below, below + 1) if abs(upper) < 1 << (bits - 1)]
    upper = min(fitting, key=lambda upper: len(signed_digits(constant - (upper << dropped))))
    return upper, dropped, constant - (upper << dropped)


def shortened(
    g: GraphBuilder, operand: Wire, coefficient: int, frac: int, kept: int, name: str, direction: int
) -> tuple[int, Wire]:
    """Return a term for the product by ``coefficient * 2**-frac``, with at most `kept` fraction bits, and its sign.

    It is floored if `direction` is 1, and rounded up if it is -1.
    """
    product = g.scale(operand, direction * coefficient, frac, name)
    return direction, g.floor(product, min(kept, g[product].frac), f"{name}_kept")
