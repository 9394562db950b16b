"""Frames to the line: responses are encoded with COBS into one of two buffers, and sent from there, again if need be.

::

    i_data 8, i_write     +-------------------+   byte, or distance    buffers, 2 x 256 bytes
    ---------------------->| [code] 8          |--------------------->+----------------------+
    i_begin, i_slot        | [index] 8         |   [code] or [index]  | 0: zero byte         |
    i_code, i_stop         +-------------------+                      | 1: the frame ..      |
                                                                      | behind it: zero byte |
    i_again, i_slot, i_count --> [unsent] 0 to 2                      +----------------------+
                                    |                                          |
                                    +---> [sending], [place] 8, [from] <-------+ o_byte 8, o_valid

A zero byte of the message is not stored: its place is kept free, at `code`, for the distance to the next one, which is
written when that comes. So every byte of the message is one write, and the two zero bytes around the frame lie in the
buffer too.
"""

from __future__ import annotations

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from sosmith.hdl.bus.frame_receiver import BLOCK_RAM


class FrameSender(wiring.Component):
    """Encodes messages into two buffers, and sends each once when it is complete, and again when asked to.

    Latency: the first byte for the line is there 2 clocks after `i_stop`. Throughput: a byte of a message per clock; a
    byte for the line every 2 clocks.

    Members
    -------
    i_begin : In(1)
        Begin a message in buffer `i_slot`; only while `o_unsent` is not 2, and with the other buffer than the last one
        unless `o_unsent` is 0.
    i_slot : In(1)
        A buffer; used with `i_begin` and `i_again`.
    i_data : In(8)
        The next byte of the message.
    i_write : In(1)
        Whether there is one.
    i_code, i_stop : In(1)
        End the message: each high for one clock, in this order. It is then sent after those before it.
    i_again : In(1)
        Send again what is in `i_slot`, and with `i_both` what is in the other buffer after it; only while `o_unsent` is
        0.
    i_both : In(1)
        See there.
    o_unsent : Out(2)
        Number of messages that are being sent or wait for it, up to 2.
    o_byte : Out(8)
        Byte for the line.
    o_valid : Out(1)
        Whether there is one.
    i_ready : In(1)
        Whether the line takes it at the next edge.
    """

    def __init__(self) -> None:
        super().__init__(
            {
                "i_begin": In(1),
                "i_slot": In(1),
                "i_data": In(8),
                "i_write": In(1),
                "i_code": In(1),
                "i_stop": In(1),
                "i_again": In(1),
                "i_both": In(1),
                "o_unsent": Out(2),
                "o_byte": Out(8),
                "o_valid": Out(1),
                "i_ready": In(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        """Build the encoder, the buffers and the reader."""
        m = Module()
        m.submodules.buffers = buffers = Memory(shape=8, depth=512, init=[], attrs=BLOCK_RAM)
        store = buffers.write_port()
        fetch = buffers.read_port()
        slot = Signal()
        code = Signal(8)
        index = Signal(8)
        zero = self.i_code | (self.i_write & (self.i_data == 0))
        m.d.comb += [
            store.addr.eq(Cat(Mux(zero, code, index), slot)),
            store.data.eq(Mux(zero, index - code, Mux(self.i_stop, 0, self.i_data))),
            store.en.eq(self.i_write | self.i_code | self.i_stop),
        ]
        with m.If(self.i_begin):
            m.d.sync += [slot.eq(self.i_slot), code.eq(1), index.eq(2)]
        with m.If(self.i_write):
            m.d.sync += index.eq(index + 1)
            with m.If(zero):
                m.d.sync += code.eq(index)
        # The reader: from address 0, which is never written, to the zero byte behind the frame.
        source = Signal()
        place = Signal(8)
        there = Signal()
        sent = Signal()
        goes = self.o_valid & self.i_ready
        m.d.comb += [
            fetch.addr.eq(Cat(place, source)),
            self.o_byte.eq(fetch.data),
            self.o_valid.eq(there),
            sent.eq(goes & (self.o_byte == 0) & (place != 0)),
        ]
        m.d.sync += there.eq((self.o_unsent != 0) & ~goes)
        with m.If(goes):
            m.d.sync += place.eq(Mux(sent, 0, place + 1))
        with m.If(sent):
            m.d.sync += source.eq(~source)
        with m.If((self.i_begin | self.i_again) & (self.o_unsent == 0)):
            m.d.sync += source.eq(self.i_slot)
        with m.If(self.i_again):
            m.d.sync += self.o_unsent.eq(1 + self.i_both)
        with m.Else():
            m.d.sync += self.o_unsent.eq(self.o_unsent + self.i_stop - sent)
        return m
