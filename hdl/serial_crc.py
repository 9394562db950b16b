"""The CRC-32 of IEEE 802.3, one bit a clock."""

from __future__ import annotations

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

BITS = 32
"""Width of the CRC."""

_POLYNOMIAL = 0xEDB88320
"""The lowest power in the highest bit: data enters with the lowest bit first."""


class SerialCrc(wiring.Component):
    """CRC-32 as of IEEE 802.3 and ``zlib.crc32``, of bytes that come with the lowest bit first.

    Latency: one clock. Throughput: one bit per clock.

    Members
    -------
    i_clear : In(1)
        Begin anew, as if nothing had come.
    i_shift : In(1)
        Take `i_bit` in; or with `i_turn` go to the next bit of the CRC, which is back at its first after 32.
    i_turn : In(1)
        Read the CRC instead of adding to it.
    i_bit : In(1)
        The next bit.
    o_bit : Out(1)
        Bit of the CRC of all that has come, the lowest first.
    """

    def __init__(self) -> None:
        super().__init__({"i_clear": In(1), "i_shift": In(1), "i_turn": In(1), "i_bit": In(1), "o_bit": Out(1)})

    def elaborate(self, platform: object) -> Module:
        """Build the shift register."""
        m = Module()
        crc = Signal(BITS, reset_less=True)
        feedback = (self.i_bit ^ crc[0]) & ~self.i_turn
        with m.If(self.i_shift):
            m.d.sync += crc.eq(Cat(crc[1:], self.i_turn & crc[0]) ^ Mux(feedback, _POLYNOMIAL, 0))
        with m.If(self.i_clear):
            m.d.sync += crc.eq(-1)
        m.d.comb += self.o_bit.eq(~crc[0])
        return m
