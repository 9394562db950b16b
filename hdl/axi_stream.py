"""AXI4-Stream: a core's ports, the fields on the bus, and a buffer that keeps back-pressure from the inputs.

::

    source                                                          sink
    i_data, i_valid --+-------------------------+--> [head] --> o_data
      width           |                         |    width
                      +--> [second] --> o_next--+    [o_valid] --> o_valid
                             width                     ^
    advance <-- not [full]                             +--- o_ready

`second` is used while the sink stalls: it takes the one word that the source delivers before it sees `advance` low.
"""

from __future__ import annotations

from collections.abc import Sequence

from amaranth.hdl import Cat, Module, Shape, Signal, Value
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from sosmith.hdl.plan.streams import dest_width, fields, width
from sosmith.model.dataflow.status import STATUS_BITS
from sosmith.model.port import Port


def core_members(inputs: Sequence[Port], output: Port, channels: int = 1, *, lanes: int = 1) -> dict[str, In | Out]:
    """Return the members of a core: clock, reset and the two streams, whose beats hold `lanes` samples."""
    members: dict[str, In | Out] = {
        "aclk": In(1),
        "aresetn": In(1),
        "s_axis_tdata": In(width(inputs) * lanes),
        "s_axis_tvalid": In(1),
        "s_axis_tready": Out(1),
        "m_axis_tdata": Out(width([output]) * lanes),
        "m_axis_tuser": Out(STATUS_BITS * lanes),
        "m_axis_tvalid": Out(1),
        "m_axis_tready": In(1),
    }
    if channels > 1:
        members |= {"s_axis_tdest": In(dest_width(channels)), "m_axis_tdest": Out(dest_width(channels))}
    return members


def codes_of(ports: Sequence[Port], tdata: Value) -> list[Value]:
    """Return the code of each port on ``tdata``: of whole bytes each, or of a single port as wide as its code."""
    places = {
        str(k): data.Field(Shape(field.port.bits, field.port.signed), field.offset)
        for k, field in enumerate(fields(ports))
    }
    sample = data.View(data.FlexibleLayout(len(tdata), places), tdata)
    return [sample[name] for name in places]


def extended(code: Value, bits: int) -> Value:
    """Return `code` extended to `bits` bits, by its sign if it is signed."""
    if len(code) >= bits:
        return code
    top = code[-1] if code.shape().signed else 0
    return Cat(code, *([top] * (bits - len(code))))


class StreamBuffer(wiring.Component):
    """Buffer of two words between a pipeline and an AXI4-Stream peer, without a combinational path across.

    The source may move while `advance` is high, which comes from a register; a word that it delivers then is never
    lost. Latency: one clock. Throughput: one word per clock.

    Parameters
    ----------
    width : int
        Width of a word, in bits.

    Members
    -------
    i_data : In(width)
        Word from the source.
    i_valid : In(1)
        Whether there is one; it is taken if `advance` is high.
    advance : Out(1)
        Whether the source may move at this clock.
    o_data, o_valid, o_ready
        The sink, by the rules of AXI4-Stream: `o_data` stays while `o_valid` is high and `o_ready` is low.
    o_next : Out(width)
        The second word; there is one while `advance` is low.
    """

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(
            {
                "i_data": In(width),
                "i_valid": In(1),
                "advance": Out(1),
                "o_data": Out(width),
                "o_valid": Out(1),
                "o_ready": In(1),
                "o_next": Out(width),
            }
        )

    def elaborate(self, platform: object) -> Module:
        """Build the logic."""
        m = Module()
        second = Signal(self.width, reset_less=True)
        full = Signal()
        head = Signal(self.width, reset_less=True)
        m.d.comb += [self.advance.eq(~full), self.o_data.eq(head), self.o_next.eq(second)]
        with m.If(self.o_ready | ~self.o_valid):
            m.d.sync += [head.eq(second), self.o_valid.eq(1), full.eq(0)]
            with m.If(~full):
                m.d.sync += [head.eq(self.i_data), self.o_valid.eq(self.i_valid)]
        with m.Elif(~full):
            m.d.sync += [second.eq(self.i_data), full.eq(self.i_valid)]
        return m
