"""Products of one operand by constants, made of adders.

::

    x --+------ << 2 ---> + [x_times_5] --+------ << 4 ---> - [x_times_75] ---> .. << 1 ---> 150 x
     8  |                 ^   11          |                 ^   15                            16
        +-----------------+               +-----------------+

Every sum is as wide as its multiple of the operand's range asks; which sums there are, and how few bits of them take an
adder, is the work of `sosmith.model.dataflow.adder_graph`. No register, so no latency: a product takes part of its
pipeline stage, like one from a multiplier block.
"""

from __future__ import annotations

from collections.abc import Sequence

from amaranth.hdl import Module, Shape, Signal, Value

from sosmith.model.dataflow.adder_graph import adder_graph, multiple_range, odd_part
from sosmith.model.dataflow.graph import Range


def multiples(m: Module, operand: Value, known: Range, constants: Sequence[int], name: str) -> list[Value]:
    """Return the products of an operand by constants, none of which is 0; the sums are named after the operand.

    Synthesis must not merge the sums with each other, nor with what is added to a product: it would make trees of
    carry-save adders of them, which take two LUT a bit where a carry chain takes one.
    """
    values: list[Value] = [operand]
    places = {1: 0}
    for adder in adder_graph(tuple(constants)):
        low, high = multiple_range(adder.multiple, known.low, known.high)
        bits = max((end if end >= 0 else ~end).bit_length() for end in (low, high))
        shape = Shape(bits + (low < 0), signed=low < 0)  # a `range` beyond 63 bits has no length
        sign = "minus_" if adder.multiple < 0 else ""
        wire = Signal(shape, name=f"{name}_times_{sign}{abs(adder.multiple)}", attrs={"keep": 1})
        left, right = (values[k].shift_left(shift) for k, shift in (adder.left, adder.right))
        m.d.comb += wire.eq(left - right if adder.subtract else left + right)
        places[adder.multiple] = len(values)
        values.append(wire)
    parts = (odd_part(constant) for constant in constants)
    return [values[places[part]].shift_left(shift) for part, shift in parts]
