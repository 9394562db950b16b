r"""Reads a frame from one of several converters on an SPI, mode 0.

::

    i_command c --i_start--> [command] << 1 ----------------> mosi
    i_bits 6 --------------> [left] - 1                       sck, from a register
    i_select n ------------> [cs_n] n ----------------------> cs_n n
    miso --->[sync0]-->[sync1]--> [frame] 32 << 1 ---> o_frame 32, o_done for one clock

    cs_n  ‾‾\_________________________________________________/‾‾‾‾‾‾‾‾‾‾‾‾
    sck   ______________/‾‾‾‾‾‾‾‾‾‾\__________/ .. ‾‾\_________________________
    mosi  --< first bit            >< second bit   ..
            |<- half ->|<- half -->|<- half ->|      |<- half ->|<- deselect ->| o_done
                                   ^ sample

The converter's output changes at falling edges of SCK. It is taken at the next one, as it was two clocks before: those
of the synchronizer. Latency: ``2 * half * bits + half + deselect + 1`` clocks from `i_start` to `o_done`.
"""

from __future__ import annotations

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

FRAME_BITS = 32
"""Bits of the longest frame."""

COMMAND_BITS = 5
"""Bits of the longest command of an ADC."""


class SpiReader(wiring.Component):
    """Reads a frame from one of several converters.

    Parameters
    ----------
    half : int
        Clocks of half an SCK period, at least 2; 1 where nothing is read.
    deselect : int
        Clocks for which CS is high between two frames, at least 1.
    selects : int
        Number of converters.
    command_bits : int
        Bits that are sent, 1 to 32: 16 make it a writer for DACs.

    Members
    -------
    i_start : In(1)
        High for one clock to begin a frame; only while none is read.
    i_select : In(selects)
        The converter, one-hot.
    i_command : In(command_bits)
        What is sent first, from the highest bit on; zeros follow.
    i_bits : In(6)
        Clocks of the frame, 1 to 32.
    o_frame : Out(32)
        What was received, the last bit lowest; bits of the frame before it are above.
    o_done : Out(1)
        High for one clock at the end of the time for which CS is high.
    sck, mosi, miso, cs_n
        The SPI; ``cs_n`` is low for the converter that is read.
    """

    def __init__(self, *, half: int, deselect: int, selects: int, command_bits: int = COMMAND_BITS) -> None:
        self.half, self.deselect, self.selects, self.command_bits = half, deselect, selects, command_bits
        super().__init__(
            {
                "i_start": In(1),
                "i_select": In(selects),
                "i_command": In(command_bits),
                "i_bits": In(range(FRAME_BITS + 1)),
                "o_frame": Out(FRAME_BITS),
                "o_done": Out(1),
                "sck": Out(1),
                "mosi": Out(1),
                "miso": In(1),
                "cs_n": Out(selects, init=-1 & (1 << selects) - 1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        """Build the timer and the shift registers."""
        m = Module()
        taken = Signal(2)
        m.d.sync += taken.eq(Cat(self.miso, taken))
        command = Signal(self.command_bits)
        left = Signal.like(self.i_bits)
        timer = Signal(range(max(self.half, self.deselect)))
        ends = timer == 0
        m.d.sync += timer.eq(Mux(ends, self.half - 1, timer - 1))
        m.d.comb += self.mosi.eq(command[-1])
        with m.FSM(name="spi"):
            with m.State("idle"):
                m.d.sync += timer.eq(self.half - 1)
                with m.If(self.i_start):
                    m.d.sync += [self.cs_n.eq(~self.i_select), command.eq(self.i_command), left.eq(self.i_bits - 1)]
                    m.next = "low"
            with m.State("low"), m.If(ends):
                m.d.sync += self.sck.eq(1)
                m.next = "high"
            with m.State("high"), m.If(ends):
                m.d.sync += [
                    self.sck.eq(0),
                    self.o_frame.eq(Cat(taken[1], self.o_frame)),
                    command.eq(command << 1),
                    left.eq(left - 1),
                ]
                m.next = "low"
                with m.If(left == 0):
                    m.next = "hold"
            with m.State("hold"), m.If(ends):
                m.d.sync += [self.cs_n.eq(-1), timer.eq(self.deselect - 1)]
                m.next = "rest"
            with m.State("rest"), m.If(ends):
                m.d.comb += self.o_done.eq(1)
                m.next = "idle"
        return m
