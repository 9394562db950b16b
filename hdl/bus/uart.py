r"""UART: a receiver and a transmitter of bytes, 8N1, at any ratio of clock to line rate from 4 on.

::

    receiver, at clock / rate = n / q clocks per bit

    i_rx --->[sync0]-->[sync1]--+--> start? --> [active]
                                |                  |
                                |        [phase] + q mod n ---> wraps: the middle of a bit
                                |                                  |
                                +--> [bits] >> 1, 9 bits <---------+
                                       |
                                       +--> o_data 8, o_valid | o_error, for one clock, in the middle of the stop bit

    transmitter

    i_data 8 --i_valid & o_ready--> [bits] >> 1, 9 bits ---> o_tx
                                       ^
                [phase] + q mod n -----+ wraps: the end of a bit

    line    ‾‾\_______/===\===\===\===\===\===\===\===/‾‾‾‾‾‾‾
               start    0   1   2   3   4   5   6   7   stop

The phase counts in units of 1 / q of a clock, so that a bit takes n / q clocks on average and differs from that by less
than one clock. It starts anew with each byte: what is left of a clock at the end of one is added to its stop bit.
"""

from __future__ import annotations

from fractions import Fraction

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

MIN_CLOCKS = 4
"""Fewest clocks per bit: the receiver then samples from 1/4 to 1/2 of a bit behind the bit's start."""

_DATA_BITS = 8


class _Phase:
    """Counter that wraps once a bit, on average."""

    def __init__(self, ratio: Fraction) -> None:
        self.step, self.modulus = ratio.denominator, ratio.numerator
        self.value = Signal(range(self.modulus), name="phase", reset_less=True)
        self.wraps = self.value >= self.modulus - self.step

    def advance(self, m: Module) -> None:
        """Count one clock."""
        m.d.sync += self.value.eq(Mux(self.wraps, self.value - (self.modulus - self.step), self.value + self.step))

    def start(self, m: Module, value: int) -> None:
        """Begin anew with a value."""
        m.d.sync += self.value.eq(value)


class UartReceiver(wiring.Component):
    """Receives bytes: a start bit, eight data bits with the lowest first, and a stop bit.

    Latency: `o_valid` is high 2 to 4 clocks after the middle of the stop bit. Throughput: bytes may follow one another
    without a gap. The clocks of both ends may differ by 2 % from 8 clocks per bit on, and by 1 % below.

    Parameters
    ----------
    ratio : Fraction
        Clocks per bit, at least `MIN_CLOCKS`.

    Members
    -------
    i_rx : In(1)
        The line; asynchronous.
    o_data : Out(8)
        The byte, while `o_valid` is high.
    o_valid : Out(1)
        High for one clock for each byte.
    o_error : Out(1)
        High for one clock for each byte whose stop bit is low: it is lost, and so is what follows until the line is
        high again. A start bit that is not low in its middle is ignored.
    """

    def __init__(self, ratio: Fraction) -> None:
        self.ratio = _checked(ratio)
        super().__init__({"i_rx": In(1), "o_data": Out(8), "o_valid": Out(1), "o_error": Out(1)})

    def elaborate(self, platform: object) -> Module:
        """Build the synchronizer, the phase and the shift register."""
        m = Module()
        sync = Signal(2, init=0b11)
        line = sync[1]
        m.d.sync += sync.eq(Cat(self.i_rx, sync[0]))
        phase = _Phase(self.ratio)
        active = Signal()
        was_high = Signal()
        # All ones at first: when the start bit, the first zero, has come to the lowest place, the data bits are above.
        bits = Signal(_DATA_BITS + 1, reset_less=True)
        m.d.comb += self.o_data.eq(bits[1:])
        with m.If(active):
            phase.advance(m)
            with m.If(phase.wraps & bits[0]):
                m.d.sync += [bits.eq(Cat(bits[1:], line)), active.eq(~(bits.all() & line))]
            with m.Elif(phase.wraps):
                m.d.comb += [self.o_valid.eq(line), self.o_error.eq(~line)]
                m.d.sync += [active.eq(0), was_high.eq(line)]
        with m.Else():
            m.d.sync += [active.eq(was_high & ~line), was_high.eq(line), bits.eq(-1)]
            phase.start(m, (phase.modulus + phase.step) // 2)
        return m


class UartTransmitter(wiring.Component):
    """Sends bytes: a start bit, eight data bits with the lowest first, and a stop bit.

    Latency: the start bit begins 2 clocks after the edge that takes the byte. Throughput: a byte every ten bits,
    rounded up to whole clocks; bytes follow one another without a gap.

    Parameters
    ----------
    ratio : Fraction
        Clocks per bit, at least `MIN_CLOCKS`.

    Members
    -------
    i_data : In(8)
        The next byte.
    i_valid : In(1)
        Whether there is one.
    o_ready : Out(1)
        Whether it is taken at the next edge.
    o_tx : Out(1)
        The line, from a register.
    """

    def __init__(self, ratio: Fraction) -> None:
        self.ratio = _checked(ratio)
        super().__init__({"i_data": In(8), "i_valid": In(1), "o_ready": Out(1), "o_tx": Out(1, init=1)})

    def elaborate(self, platform: object) -> Module:
        """Build the phase and the shift register."""
        m = Module()
        phase = _Phase(self.ratio)
        bits = Signal(_DATA_BITS + 2)  # what is left to be sent: the stop bit is the highest one
        last = ~bits[1:].any()
        m.d.sync += self.o_tx.eq(bits[0] | last)
        phase.advance(m)
        with m.If(phase.wraps):
            m.d.sync += bits.eq(bits[1:])
        m.d.comb += self.o_ready.eq(last & (phase.wraps | ~bits[0]))
        with m.If(self.o_ready & self.i_valid):
            phase.start(m, 0)
            m.d.sync += bits.eq(Cat(0, self.i_data, 1))
        return m


def _checked(ratio: Fraction) -> Fraction:
    if ratio < MIN_CLOCKS:
        raise ValueError(f"ratio must be at least {MIN_CLOCKS}, not {ratio}")
    return ratio
