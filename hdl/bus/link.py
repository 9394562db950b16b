"""The link of a board: from the serial line to the faces of a core, and back.

::

           +--------------+  8   +---------------+      +---------------+
    rx --->| UartReceiver |----->| FrameReceiver |----->|               |---> s_axis_*
           +--------------+      +---------------+      | CommandEngine |<--> s_axil_*
           +-----------------+  8  +-------------+      |               |<--- m_axis_*
    tx <---| UartTransmitter |<----| FrameSender |<-----|               |---> aresetn
           +-----------------+     +-------------+      +---------------+
                                                          |
               o_error, o_malformed, o_overrun ---> FaultCounters
                                                          |
    leds <--- [activity], [damaged], [alarm] <------------+--- m_axis_tuser, or o_status of a front-end

Latency, from the end of a request to the begin of its response: 9 clocks for each byte of both, and that of the core
for each sample.
"""

from __future__ import annotations

from fractions import Fraction

from amaranth.hdl import Cat, ClockDomain, ClockSignal, Module, ResetSignal, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from sosmith.hdl.bus.command_engine import CommandEngine, Face, core_side
from sosmith.hdl.bus.fault_counters import FaultCounters
from sosmith.hdl.bus.frame_receiver import FrameReceiver
from sosmith.hdl.bus.frame_sender import FrameSender
from sosmith.hdl.bus.uart import UartReceiver, UartTransmitter
from sosmith.model.dataflow.status import Flag
from sosmith.model.link.protocol import Counter

LEDS = 3
"""Status LEDs; a board with fewer has the first ones."""

_ALARMS = (Flag.WEAR_CRITICAL, Flag.FAULT)


class Link(wiring.Component):
    """The serial link of docs/protocol.md, from the line to a core.

    Parameters
    ----------
    face : Face
        The core's faces.
    memory : bytes
        The identity, as `sosmith.hdl.bus.command_engine.CommandEngine` takes it.
    ratio : Fraction
        Clocks per bit of the line, at least `sosmith.hdl.bus.uart.MIN_CLOCKS`.

    waits : bool
        Whether the link, too, is in reset while `rst` is high, as its clock has another frequency until then.

    Members
    -------
    clk, rst, rx, tx, leds
        As those of `sosmith.hdl.boards.board_top.BoardTop`.
    aresetn : Out(1)
        Reset of the core, active low.
    s_axis_*, m_axis_*, s_axil_*
        The core's faces, or those of a front-end, as those of a `CommandEngine`.
    """

    def __init__(self, face: Face, memory: bytes, *, ratio: Fraction, waits: bool = False) -> None:
        self.face, self.memory, self.ratio, self.waits = face, memory, ratio, waits
        outside = {"clk": In(1), "rst": In(1), "rx": In(1), "tx": Out(1), "leds": Out(LEDS), "aresetn": Out(1)}
        super().__init__(outside | core_side(face))

    def elaborate(self, platform: object) -> Module:
        """Connect everything."""
        m = Module()
        m.domains.sync = ClockDomain(local=True, reset_less=not self.waits)
        m.d.comb += ClockSignal("sync").eq(self.clk)
        if self.waits:
            m.d.comb += ResetSignal("sync").eq(self.rst)
        m.submodules.uart_receiver = line_in = UartReceiver(self.ratio)
        m.submodules.uart_transmitter = line_out = UartTransmitter(self.ratio)
        m.submodules.frame_receiver = receiver = FrameReceiver()
        m.submodules.frame_sender = sender = FrameSender()
        m.submodules.engine = engine = CommandEngine(self.face, self.memory)
        m.submodules.counters = counters = FaultCounters()
        m.d.comb += [
            line_in.i_rx.eq(self.rx),
            receiver.i_data.eq(line_in.o_data),
            receiver.i_valid.eq(line_in.o_valid),
            receiver.i_address.eq(engine.o_address),
            receiver.i_release.eq(engine.o_release),
            engine.i_full.eq(receiver.o_full),
            engine.i_data.eq(receiver.o_data),
            sender.i_begin.eq(engine.o_begin),
            sender.i_slot.eq(engine.o_slot),
            sender.i_data.eq(engine.o_data),
            sender.i_write.eq(engine.o_write),
            sender.i_code.eq(engine.o_code),
            sender.i_stop.eq(engine.o_stop),
            sender.i_again.eq(engine.o_again),
            sender.i_both.eq(engine.o_both),
            engine.i_unsent.eq(sender.o_unsent),
            line_out.i_data.eq(sender.o_byte),
            line_out.i_valid.eq(sender.o_valid),
            sender.i_ready.eq(line_out.o_ready),
            self.tx.eq(line_out.o_tx),
            counters.i_address.eq(engine.o_count),
            engine.i_count.eq(counters.o_data),
            engine.i_settled.eq(counters.o_settled),
            self.aresetn.eq(~(self.rst | engine.o_reset)),
        ]
        of_line = Signal(len(Counter))
        m.d.comb += [
            of_line[Counter.FRAMING].eq(line_in.o_error),
            of_line[Counter.MALFORMED].eq(receiver.o_malformed),
            of_line[Counter.OVERRUN].eq(receiver.o_overrun),
            counters.i_events.eq(of_line | engine.o_events),
        ]
        for name, member in core_side(self.face).items():
            inner, outer = getattr(engine, name), getattr(self, name)
            m.d.comb += inner.eq(outer) if member.flow is In else outer.eq(inner)
        activity = Signal()
        damaged = Signal()
        alarm = Signal()
        with m.If(engine.o_accepted):
            m.d.sync += activity.eq(~activity)
        with m.If(engine.o_reset):
            m.d.sync += damaged.eq(0)
        with m.Elif(of_line.any() | engine.o_events[Counter.CRC]):
            m.d.sync += damaged.eq(1)
        new, status = (self.o_new, self.o_status) if self.face.readings else (self.m_axis_tvalid, self.m_axis_tuser)
        with m.If(new):
            m.d.sync += alarm.eq(Cat(status[flag] for flag in _ALARMS).any())
        m.d.comb += self.leds.eq(Cat(activity, damaged, alarm))
        return m
