"""The shell of every core: clock, reset, streams and registers, and what a sample has beside its codes.

::

                   +-- Shell ------------------------------------------------------------------------+
    s_axis_tdata ->|-- codes -------------> inside of the core --> code, flags --> output buffer ----|-> m_axis_tdata
      width x lanes|-- status_of_inputs --> inside of the core --> status_of_result       1 clock    |-> m_axis_tuser
    s_axis_tuser ->|      2 bits                                    7 bits x lanes                   |   8 bits x lanes
    s_axil_* <---->|-- reload port <-------> banks                                                   |
                   |-- guard <-------------- corrected, failed, of all memories                      |
                   +---------------------------------------------------------------------------------+

Latency: that of the inside, and a clock of the output buffer where there is one. What is inside is hardware of the same
module: the shell adds no level of hierarchy to what is emitted.
"""

from __future__ import annotations

from collections.abc import Sequence

from amaranth.hdl import Cat, ClockDomain, ClockSignal, Const, Module, ResetSignal, Value
from amaranth.lib import data, wiring

from sosmith.hdl.axi_stream import StreamBuffer, codes_of, core_members, extended
from sosmith.hdl.bus.axi_lite import forward_slave, slave_members
from sosmith.hdl.plan.streams import channel_bits, width
from sosmith.hdl.reload import ReloadPort
from sosmith.hdl.shell.bank_pins import BankPins, bank_members
from sosmith.hdl.shell.fault_guard import FaultGuard
from sosmith.hdl.status import (
    NEVER,
    OF_INPUT,
    at_rail,
    flag_count,
    members_beside_decimator,
    outside_calibration,
)
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.status import STATUS_BITS, Flag
from sosmith.model.reload.registers import ADDRESS_BITS


class Shell(wiring.Component):
    """A core without its inside, which `fill` adds.

    Parameters
    ----------
    datapath : Datapath
        What the core computes.
    channels : int
        Number of channels.
    fingerprint : int or None
        Fingerprint of the structure, 32 bits; None for a core whose constants cannot be loaded.
    lanes : int
        Samples of a beat of the streams.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`.
    lock : bool
        Whether loading can be locked until a reset; only with a fingerprint.
    flags_given : int
        How many flags of the inputs come with a sample, from a decimator, and are not read off its codes: the first of
        `sosmith.model.dataflow.status.Flag`.
    before_decimator : bool
        Whether its results go to a decimator.
    pins : (int, int) or None
        Words of a bank and bits of each, if constants are loaded at pins; None if the core has its own registers.

    Members
    -------
    aclk : In(1)
        Clock, rising edge.
    aresetn : In(1)
        Synchronous reset, active low.
    s_axis_tdata, s_axis_tvalid, s_axis_tready
        Input samples, the first one lowest; in each, one field per input port, extended to whole bytes.
    s_axis_tuser : In(flags_given)
        Flags of the sample; only if they are given. With protection there is one more bit, which says whether a wrong
        bit may have changed the sample.
    i_corrected, o_corrected : In(1), Out(1)
        Whether a wrong bit is corrected at this clock, in what stands before the core, and in one before a decimator;
        only with protection.
    m_axis_tdata, m_axis_tvalid, m_axis_tready
        Output samples: one field each, extended likewise.
    m_axis_tuser : Out(8 * lanes)
        Status of each output sample; the bits are those of `sosmith.model.dataflow.status.Flag`.
    s_axis_tdest, m_axis_tdest
        Channel of the sample, in whole bytes; only with several channels.
    s_axil_*
        AXI4-Lite slave of a `sosmith.hdl.reload.ReloadPort`; only with a fingerprint.
    reload_*
        Those of `sosmith.hdl.shell.bank_pins` in their place, with `pins`.
    """

    def __init__(
        self,
        datapath: Datapath,
        channels: int = 1,
        fingerprint: int | None = None,
        *,
        lanes: int = 1,
        protect: str = "none",
        lock: bool = False,
        flags_given: int = 0,
        before_decimator: bool = False,
        pins: tuple[int, int] | None = None,
    ) -> None:
        self.pins = pins
        self.datapath = datapath
        self.channels = channels
        self.fingerprint = fingerprint
        self.lanes = lanes
        self.protect = protect
        self.lock = lock
        self.flags_given = flags_given
        self.before_decimator = before_decimator
        members = core_members(datapath.inputs, datapath.output, channels, lanes=lanes)
        members |= members_beside_decimator(datapath, flags_given, before=before_decimator, guarded=self.is_guarded)
        if pins is not None:
            members |= bank_members(*pins, protected=self.is_guarded)
        elif fingerprint is not None:
            members |= slave_members(ADDRESS_BITS)
        super().__init__(members)

    def elaborate(self, platform: object) -> Module:
        """Build the core."""
        m = Module()
        m.domains.sync = ClockDomain(local=True)
        m.d.comb += [ClockSignal("sync").eq(self.aclk), ResetSignal("sync").eq(~self.aresetn)]
        self.fill(m)
        return m

    def fill(self, m: Module) -> None:
        """Build what is inside."""
        raise NotImplementedError

    @property
    def is_guarded(self) -> bool:
        """Whether wrong bits are looked for."""
        return self.protect != "none"

    @property
    def restarts(self) -> bool:
        """Whether the core clears its states when other constants are loaded."""
        return self.fingerprint is not None and self.datapath.restarts

    @property
    def live_flags(self) -> Sequence[int]:
        """Bits of the status that a result may set: the others have no registers."""
        flags = [*range(flag_count(self.datapath)), *([Flag.FAULT] if self.is_guarded else [])]
        return flags[: len(self.m_axis_tuser) // self.lanes]

    def codes(self, tdata: Value) -> list[Value]:
        """Return the codes of a sample on `s_axis_tdata`."""
        return codes_of(self.datapath.inputs, tdata)

    @property
    def given_flags(self) -> Value:
        """The flags that come with a sample."""
        return self.s_axis_tuser[: self.flags_given]

    @property
    def given_fault(self) -> Value:
        """Whether a wrong bit may have changed the sample before it came here."""
        return self.s_axis_tuser[self.flags_given] if self.flags_given and self.is_guarded else NEVER

    def status_of_inputs(self, tdata: Value, given: Value | None = None) -> Value:
        """Return the flags that are known with a sample as it comes in: two, the first of which may be `given`."""
        if given is not None and len(given) == OF_INPUT:
            return given
        rail = at_rail(self.datapath.inputs, tdata) if given is None else given
        return Cat(rail, outside_calibration(self.datapath, tdata))

    def output_buffer(self, m: Module) -> StreamBuffer:
        """Make the buffer that results leave through; the pipeline before it moves when it can `advance`."""
        results = (width([self.datapath.output]) if self.lanes > 1 else len(self.m_axis_tdata), len(self.live_flags))
        buffer = StreamBuffer(sum(results) * self.lanes + channel_bits(self.channels))
        m.submodules.output_buffer = buffer
        return buffer

    def hand_out(
        self,
        m: Module,
        buffer: StreamBuffer,
        valid: Value,
        results: Sequence[tuple[Value, Value]],
        channel: Value | None = None,
        *,
        leaves: Value | None = None,
    ) -> None:
        """Pass results through the buffer to `m_axis_*`: code and flags of each lane, in the bits of `Flag`.

        A result leaves with its handshake, unless `leaves` says when it does.
        """
        bits = len(self.m_axis_tdata) // self.lanes
        word = {
            "codes": Cat(extended(code, bits) for code, _ in results),
            "flags": Cat(flags[bit] for _, flags in results for bit in self.live_flags),
            "channel": Const(0, 0) if channel is None else channel,
        }
        m.d.comb += [
            buffer.i_valid.eq(valid),
            buffer.i_data.eq(Cat(*word.values())),
            self.m_axis_tvalid.eq(buffer.o_valid),
            buffer.o_ready.eq(self.m_axis_tready if leaves is None else leaves),
        ]
        handed = data.View(data.StructLayout({name: len(value) for name, value in word.items()}), buffer.o_data)
        flags = iter(handed.flags)
        user = Cat(
            next(flags) if bit in self.live_flags else Const(0, 1) for _ in results for bit in range(STATUS_BITS)
        )
        m.d.comb += [self.m_axis_tdata.eq(handed.codes), self.m_axis_tuser.eq(user)]
        if self.channels > 1:
            m.d.comb += self.m_axis_tdest.eq(handed.channel)

    def join_port(self, m: Module, port: ReloadPort | BankPins, begun: Value = NEVER) -> None:
        """Add the reload port, and connect it to `s_axil_*`, or to pins.

        `begun` says whether a sample that is not taken yet, but perhaps at this clock, has chosen its bank; one that
        does so at the clock at which it is taken may be left out.
        """
        if isinstance(port, BankPins):
            port.join(m, self, begun)
            return
        m.submodules.reload_port = port
        forward_slave(m, self, port)

    def report(
        self,
        m: Module,
        guard: FaultGuard,
        port: ReloadPort | BankPins | None,
        found: tuple[Value, Value],
        begins: Value,
    ) -> None:
        """Tell the guard, and the registers if there are any, what was corrected and what was not, at this clock.

        Before a decimator, the fault of a sample ends when the next one `begins`: which results it reaches is counted
        there.
        """
        corrected, failed = found
        m.d.comb += guard.failed.eq(failed)
        if self.before_decimator:
            m.d.comb += [guard.acknowledge.eq(begins), self.o_corrected.eq(corrected)]
        if port is not None:
            m.d.comb += [
                port.corrected.eq(corrected | self.i_corrected if self.flags_given else corrected),
                port.failed.eq(guard.failed),
                guard.acknowledge.eq(port.acknowledge),
            ]
