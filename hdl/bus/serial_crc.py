"""The CRC-32 of IEEE 802.3, one bit per clock.

::

    i_bit ---> xor ---> and ---> feedback
                ^        ^
             crc[0]   not i_turn

    crc <= {i_turn and crc[0], crc[31:1]} xor (feedback ? polynomial : 0)     32 bits, at i_shift
    o_bit = not crc[0]

Latency: one clock. Throughput: one bit per clock.

`amaranth.lib.crc` with a data width of one bit computes the same, but shows all 32 bits at once: to read them one by
one, as the AXI4-Lite slave needs them, takes a multiplexer. Turning the register instead, this one takes 16 LUT4 of an
iCE40 where that takes 63, and 76 of an ECP5 where that takes 88, with 32 flip-flops each (Yosys, `synth_ice40` and
`synth_ecp5`).
"""

from __future__ import annotations

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

BITS = 32
"""Width of the CRC."""

_POLYNOMIAL = 0xEDB88320
"""Its lowest power is the highest bit, as data enters with the lowest bit first."""


class SerialCrc(wiring.Component):
    """CRC-32 of IEEE 802.3, as ``zlib.crc32``, of bytes that arrive with the lowest bit first.

    Latency: one clock. Throughput: one bit per clock.

    Members
    -------
    i_clear : In(1)
        Start anew.
    i_shift : In(1)
        Add `i_bit` to the CRC; or, with `i_turn`, go on to its next bit. After 32 of these it is back at the first.
    i_turn : In(1)
        Whether the CRC is being read.
    i_bit : In(1)
        The next bit.
    o_bit : Out(1)
        Bit of the CRC of all bits so far, the lowest first.
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
