"""Frames from the line: COBS is decoded into one of two buffers, whole messages are handed on in order.

::

    i_data 8    +--------------------------+  byte, or 0     buffers, 2 x 256 bytes
    i_valid --->| COBS: [left] 8, [begun]  |------------->+------------------+
                +--------------------------+  [slot],     | 0: message ..    |
                       |   zero byte:         [index] 8   | 255: its length  |---> o_data 8
                       |   the end                        +------------------+
                       |                                        ^
                       +--> [held] 0 to 2 --> o_full            | [first], i_address 8
                       +--> o_malformed, o_overrun              |
                i_release: the oldest message is done with -----+

A byte behind a zero byte is a code: the distance to the next code, in whose place the message has a zero byte. A frame
is complete if the zero byte that ends it stands where the next code is due. Latency: a byte is in its buffer a clock
after `i_valid`.
"""

from __future__ import annotations

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from sosmith.model.link.protocol import MAX_MESSAGE, MIN_MESSAGE

BLOCK_RAM = {"ram_style": "block", "no_rw_check": 1}
"""Attributes of the link's memories: no word is used that is read at the clock at which it is written."""

LENGTH_ADDRESS = 255
"""Where the length of a message lies in its buffer, behind any message."""


class FrameReceiver(wiring.Component):
    """Decodes frames into two buffers; drops those that are no messages, or find no buffer free.

    The CRC is not looked at. Throughput: a byte per clock.

    Members
    -------
    i_data : In(8)
        Byte from the line.
    i_valid : In(1)
        High for one clock for each byte.
    o_full : Out(1)
        Whether there is a message.
    i_address : In(8)
        Address in the oldest message; at 255 is its length, `MIN_MESSAGE` to `MAX_MESSAGE`.
    o_data : Out(8)
        Its byte there, one clock later.
    i_release : In(1)
        The oldest message is done with; only while `o_full` is high.
    o_malformed, o_overrun : Out(1)
        High for one clock at the end of a frame that is not complete or has a wrong length; and of one that began when
        no buffer was free. Two zero bytes in a row are not a frame.
    """

    def __init__(self) -> None:
        super().__init__(
            {
                "i_data": In(8),
                "i_valid": In(1),
                "o_full": Out(1),
                "i_address": In(8),
                "o_data": Out(8),
                "i_release": In(1),
                "o_malformed": Out(1),
                "o_overrun": Out(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        """Build the decoder and the buffers."""
        m = Module()
        m.submodules.buffers = buffers = Memory(shape=8, depth=512, init=[], attrs=BLOCK_RAM)
        store = buffers.write_port()
        fetch = buffers.read_port()
        left = Signal(8)
        index = Signal(8)
        begun = Signal()
        dropped = Signal()
        too_long = Signal()
        slot = Signal()
        first = Signal()
        held = Signal(2)
        ends, code = self.i_data == 0, left == 0
        # The first code of a frame stands for no byte; every other one for a zero byte.
        gives = ~ends & (begun | ~code)
        accepted = Signal()
        stores = Signal()
        m.d.comb += [
            store.addr.eq(Cat(Mux(ends, LENGTH_ADDRESS, index), slot)),
            store.data.eq(Mux(ends, index, Mux(code, 0, self.i_data))),
            stores.eq(self.i_valid & (accepted | (gives & ~dropped & (index != MAX_MESSAGE)))),
            store.en.eq(stores),
            fetch.addr.eq(Cat(self.i_address, first)),
            self.o_data.eq(fetch.data),
            self.o_full.eq(held != 0),
        ]
        with m.If(self.i_valid):
            with m.If(ends):
                malformed = ~code | too_long | (index < MIN_MESSAGE)
                m.d.comb += [
                    accepted.eq(begun & ~dropped & ~malformed),
                    self.o_overrun.eq(begun & dropped),
                    self.o_malformed.eq(begun & ~dropped & malformed),
                ]
                m.d.sync += [begun.eq(0), dropped.eq(0), too_long.eq(0), left.eq(0), index.eq(0)]
                m.d.sync += slot.eq(slot ^ accepted)
            with m.Else():
                m.d.sync += [begun.eq(1), left.eq(Mux(code, self.i_data, left) - 1)]
                with m.If(~begun):
                    m.d.sync += dropped.eq(held[1])
                with m.If(gives):
                    m.d.sync += [index.eq(index + (index != MAX_MESSAGE)), too_long.eq(index == MAX_MESSAGE)]
        m.d.sync += [held.eq(held + accepted - self.i_release), first.eq(first ^ self.i_release)]
        return m
