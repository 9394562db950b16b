"""One byte after another through the CRC-32: added to it, or compared with it, or taken from it.

::

    i_data 8 --i_start--> [data] >> 1 ---> data[0] ---> SerialCrc ---> o_bit
                             ^                             ^             |
                             |                          i_turn           +---> = data[0]? ---> [wrong] ---> o_wrong
                             +---- data[0], or o_bit with i_turn <-------+
                             |
                             +----> o_data 8, o_write after 8 clocks

With `i_turn`, the byte is compared with the next byte of the CRC, and becomes that. Latency: 9 clocks from `i_start` to
`o_write`. Throughput: a byte every 9 clocks.
"""

from __future__ import annotations

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from sosmith.hdl.bus.serial_crc import SerialCrc


class CheckedBytes(wiring.Component):
    """Takes bytes into a CRC-32, and compares or continues them with it.

    Members
    -------
    i_clear : In(1)
        Start a new CRC, and clear `o_wrong`; only while `o_busy` is low.
    i_start : In(1)
        Take `i_data`; only while `o_busy` is low.
    i_data : In(8)
        The byte.
    i_turn : In(1)
        The byte is not added to the CRC but compared with its next byte, the lowest first, which takes its place.
    i_write : In(1)
        Whether to hand the byte on.
    o_busy : Out(1)
        High for 8 clocks after `i_start`.
    o_data : Out(8)
        The byte, while `o_write` is high.
    o_write : Out(1)
        High for one clock behind `o_busy`, if `i_write` was high.
    o_wrong : Out(1)
        Whether a byte has differed from the CRC since `i_clear`.
    """

    def __init__(self) -> None:
        super().__init__(
            {
                "i_clear": In(1),
                "i_start": In(1),
                "i_data": In(8),
                "i_turn": In(1),
                "i_write": In(1),
                "o_busy": Out(1),
                "o_data": Out(8),
                "o_write": Out(1),
                "o_wrong": Out(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        """Build the shift register around the CRC."""
        m = Module()
        m.submodules.crc = crc = SerialCrc()
        data = Signal(8, reset_less=True)
        count = Signal(3)
        turns = Signal()
        writes = Signal()
        m.d.comb += [
            crc.i_clear.eq(self.i_clear),
            crc.i_shift.eq(self.o_busy),
            crc.i_turn.eq(turns),
            crc.i_bit.eq(data[0]),
            self.o_data.eq(data),
        ]
        m.d.sync += self.o_write.eq(self.o_busy & writes & count.all())
        with m.If(self.o_busy):
            m.d.sync += [data.eq(Cat(data[1:], Mux(turns, crc.o_bit, data[0]))), count.eq(count + 1)]
            m.d.sync += [self.o_busy.eq(~count.all()), self.o_wrong.eq(self.o_wrong | (turns & (data[0] ^ crc.o_bit)))]
        with m.If(self.i_clear):
            m.d.sync += self.o_wrong.eq(0)
        with m.If(self.i_start):
            m.d.sync += [data.eq(self.i_data), turns.eq(self.i_turn), writes.eq(self.i_write), self.o_busy.eq(1)]
        return m
