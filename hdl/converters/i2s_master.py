r"""The master of an I2S: makes its clocks, takes the words of ADCs and gives words to DACs.

::

    [timer]--half_bit--> [bclk] --falls--> [bit] 6 --> [lrck]     [mclk_timer]--half_mclk--> [mclk]

    din n --->[sync0]-->[sync1]--> [received] 64 << 1 each --frame ends--> [o_left], [o_right] 24 each, o_tick
    i_left, i_right 24 each --frame ends--> [sending] 64 << 1 each ------> dout n

    lrck  ‾‾\_________________________________/‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾\__
    bclk  ‾\_/‾\_/‾\_/‾\_ .. _/‾\_ .. _/‾\_/‾\_/‾\_/‾\_ .. _/‾\_ .. _/‾\_/‾\_/‾\_
    bit    |0  |1  |2  |  .. |24 |  .. |31 |32 |33 |34 |    |56 |  .. |63 |0  |
    data       <  left, 24 bits  > 0 ..        < right, 24 bits > 0 ..
             ^ dout changes                                               ^ o_tick, the clock before
               ^ din is taken where bclk falls, as it was two clocks before

Latency: `o_left` and `o_right` change with the end of the frame that has them; `i_left` and `i_right` of that moment
go out in the frame that begins. Throughput: a frame every ``frame.clocks`` clocks.
"""

from __future__ import annotations

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from sosmith.model.converters.i2s_converter import MAX_WIDTH
from sosmith.model.converters.i2s_frame import FRAME_BITS, I2sFrame

_SLOT = FRAME_BITS // 2


class I2sMaster(wiring.Component):
    """Makes the clocks of an I2S, and shifts words in and out.

    Parameters
    ----------
    frame : I2sFrame
        The clocks.
    lines_in, lines_out : int
        Data lines from ADCs and to DACs.

    Members
    -------
    mclk, bclk, lrck : Out(1)
        Clocks, from registers; LRCK is low for the left word.
    din : In(lines_in)
        Data of the ADCs; only with some.
    dout : Out(lines_out)
        Data for the DACs, from registers; only with some.
    o_tick : Out(1)
        High in the last clock of each frame.
    o_left, o_right : Out(24 * lines_in)
        Words of the last frame, that of the first line lowest; only with ADCs.
    i_left, i_right : In(24 * lines_out)
        Words for the next frame; only with DACs.
    """

    def __init__(self, frame: I2sFrame, *, lines_in: int, lines_out: int) -> None:
        self.frame, self.lines_in, self.lines_out = frame, lines_in, lines_out
        members: dict[str, In | Out] = {
            "mclk": Out(1),
            "bclk": Out(1),
            "lrck": Out(1, init=1),
            "o_tick": Out(1),
        }
        if lines_in:
            words = Out(MAX_WIDTH * lines_in)
            members |= {"din": In(lines_in), "o_left": words, "o_right": words}
        if lines_out:
            members |= {
                "dout": Out(lines_out),
                "i_left": In(MAX_WIDTH * lines_out),
                "i_right": In(MAX_WIDTH * lines_out),
            }
        super().__init__(members)

    def elaborate(self, platform: object) -> Module:
        """Build the clocks and the shift registers."""
        m = Module()
        falls = self.clocks(m)
        for line in range(self.lines_in):
            self.receive(m, line, falls)
        for line in range(self.lines_out):
            self.send(m, line, falls)
        return m

    def clocks(self, m: Module) -> Signal:
        """Make the clocks; return what is high in the last clock before BCLK falls."""
        falls = Signal()
        timer = Signal(range(self.frame.half_bit))
        ends = timer == self.frame.half_bit - 1
        m.d.sync += timer.eq(Mux(ends, 0, timer + 1))
        with m.If(ends):
            m.d.sync += self.bclk.eq(~self.bclk)
        m.d.comb += falls.eq(ends & self.bclk)
        # The last bit of a frame goes first, so that the first frame begins with an edge of LRCK.
        bit = Signal(range(FRAME_BITS), init=FRAME_BITS - 1)
        with m.If(falls):
            m.d.sync += [bit.eq(bit + 1), self.lrck.eq((bit + 1)[: len(bit)] >= _SLOT)]
        m.d.comb += self.o_tick.eq(falls & (bit == FRAME_BITS - 1))
        mclk_timer = Signal(range(max(2, self.frame.half_mclk)))
        mclk_ends = mclk_timer == self.frame.half_mclk - 1
        m.d.sync += mclk_timer.eq(Mux(mclk_ends, 0, mclk_timer + 1))
        with m.If(mclk_ends):
            m.d.sync += self.mclk.eq(~self.mclk)
        return falls

    def receive(self, m: Module, line: int, falls: Signal) -> None:
        """Take a line of ADCs."""
        taken = Signal(2, name=f"taken{line}")
        received = Signal(FRAME_BITS - 1, name=f"received{line}")
        whole = Cat(taken[1], received)  # the last bit lowest
        m.d.sync += taken.eq(Cat(self.din[line], taken))
        with m.If(falls):
            m.d.sync += received.eq(whole)
        right = whole[_SLOT - 1 - MAX_WIDTH : _SLOT - 1]
        left = whole[FRAME_BITS - 1 - MAX_WIDTH : FRAME_BITS - 1]
        with m.If(self.o_tick):
            m.d.sync += [
                self.o_left.word_select(line, MAX_WIDTH).eq(left),
                self.o_right.word_select(line, MAX_WIDTH).eq(right),
            ]

    def send(self, m: Module, line: int, falls: Signal) -> None:
        """Serve a line of DACs."""
        sending = Signal(FRAME_BITS, name=f"sending{line}")
        rest = Const(0, _SLOT - 1 - MAX_WIDTH)
        words = (self.i_right.word_select(line, MAX_WIDTH), self.i_left.word_select(line, MAX_WIDTH))
        with m.If(falls):
            m.d.sync += sending.eq(sending << 1)
        with m.If(self.o_tick):
            m.d.sync += sending.eq(Cat(*(Cat(rest, word, Const(0, 1)) for word in words)))
        m.d.comb += self.dout[line].eq(sending[-1])
