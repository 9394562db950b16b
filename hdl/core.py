"""The parallel architecture: a datapath's stages in a pipeline between two AXI4-Stream interfaces.

With one channel, as in the bench example of a calibration and a filter::

                      row_power1    column_power2       section0      output_stage    output_buffer
    s_axis_tdata --+---> stage ------> stage ---- .. ---> stage -- .. --> stage ------> StreamBuffer ---> m_axis_tdata
                   |    1 clock       1 clock         1 to 3 clocks      1 clock    +->   1 clock    ---> m_axis_tuser
                   |                                                                |      |
                   +--> status --[status1]---[status2]-- ..  one for each clock ----+      |
                                                                                           |
    s_axis_tready <--------------------------- advance <-----------------------------------+

Every datapath stage has one to three pipeline stages, `sosmith.hdl.stages.pipelined`; all of them move at the clocks at
which `advance`, which comes from a register of the output buffer, is high.

Several channels take the stages of `sosmith.hdl.stages.interleaved`, whose states lie in memories, and an input buffer,
which holds back a sample of a channel whose last one is still in a recursion::

    s_axis_tdata --> input_buffer ----------------> stages --> output_buffer --> m_axis_tdata
    s_axis_tdest       1 clock       |       ^                                   m_axis_tdest
                          ^          v       | valid
                          |        [near0] [near1] ..   the channels of the last samples
                          |          |       |
                          +-- waits--+-------+   one of them is that of the sample in front

With protection, every sample takes along whether a wrong bit was found in a state or a constant that it met; the first
such sample raises the flag `fault`, and the core restarts once it has left::

    fault of the sample --> guard --> fault, of all samples from this one on
                              |
                              +-----> broken: no sample enters --> [inside] = 0 --> restart: states are cleared
                              +-----> scrubs: a place in the pipeline without a sample, with several channels

With loadable constants, `sosmith.hdl.constant_banks` has them twice, and each sample takes its bank along. A core that
judges wear restarts with new ones, as it would with a fault::

    load is complete --> pending: no sample enters --> [inside] = 0 --> swap: the other bank, states are cleared
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import reduce
from operator import or_
from typing import NamedTuple

from amaranth.hdl import Cat, ClockDomain, ClockSignal, Const, Module, Mux, ResetSignal, Signal, Value
from amaranth.lib import wiring

from sosmith.hdl.axi_stream import StreamBuffer, core_members, extended
from sosmith.hdl.bus.axi_lite import forward_slave, slave_members
from sosmith.hdl.constant_banks import NO_CONSTANTS, ConstantBanks, Pair
from sosmith.hdl.fault_guard import FaultGuard
from sosmith.hdl.pipelined_logic import banks_in_use
from sosmith.hdl.plan.parallel_clocks import depths
from sosmith.hdl.plan.streams import channel_bits, fields
from sosmith.hdl.reload import ReloadPort
from sosmith.hdl.stages.interleaved import InterleavedStage
from sosmith.hdl.stages.pipelined import PipelinedStage
from sosmith.hdl.status import (
    OF_INPUT,
    at_rail,
    flag_count,
    members_beside_decimator,
    outside_calibration,
    status_of_result,
    with_fault,
)
from sosmith.model.dataflow.datapath import Datapath, Stage
from sosmith.model.reload.constants import constants
from sosmith.model.reload.registers import ADDRESS_BITS


class _Place(NamedTuple):
    """What goes through the pipeline with the codes: whether there is a sample, its channel, and its bank.

    Besides, whether there is a scrub instead, and whether a wrong bit was found for either.
    """

    valid: Value
    channel: Value
    bank: Value
    scrub: Value = Const(0, 1)
    fault: Value = Const(0, 1)


class _Swap(NamedTuple):
    """How a core that restarts with other constants takes them over.

    Attributes
    ----------
    pending : Signal
        Whether a swap is due: no sample may enter.
    may : Signal
        Whether no sample is inside, so that it may be.
    """

    pending: Signal
    may: Signal

    @property
    def now(self) -> Value:
        """Whether it is at this clock: states are cleared from the next one on."""
        return self.pending & self.may


class Core(wiring.Component):
    """A datapath in the parallel architecture: every operation has its own hardware.

    Latency: `latency_cycles` of the datapath, without a stall. Throughput: one sample per clock. With several channels,
    samples may come in any order; one that comes too soon after another of its channel waits, for fewer clocks than
    there are channels. A sample of a channel that does not exist is accepted and dropped. After a reset, the states of
    several channels are cleared in one clock each.

    With protection, a wrong bit in a state that is not corrected, or in a loaded constant, raises the flag `fault` with
    the first sample that it could change, and with all later ones until a reset. The core then lets the samples inside
    leave, clears all states as after a reset, and goes on. The states of one channel, and loaded constants, are
    registers: they have parity, so that a wrong bit is detected even where those in memories are corrected.

    Parameters
    ----------
    datapath : Datapath
        What it computes.
    channels : int
        Number of channels.
    fingerprint : int or None
        Fingerprint of the structure, 32 bits; None for a core whose constants cannot be loaded. Otherwise they can be
        loaded while the core works: each sample is computed with the bank that was active when the core accepted it.
        If the datapath `restarts`, a swap waits until all samples inside have left, and clears the states as a reset
        does; meanwhile no sample is accepted.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`.
    adders : sequence of collection of int
        Products by constants that are made of adders, by stage and node; only without a fingerprint.
    flags_given : int
        How many flags of the inputs come with a sample, from a decimator, and are not read off its codes: the first of
        `sosmith.model.dataflow.status.Flag`.
    before_decimator : bool
        Whether its results go to a decimator.

    Members
    -------
    aclk : In(1)
        Clock, rising edge.
    aresetn : In(1)
        Synchronous reset, active low.
    s_axis_tdata, s_axis_tvalid, s_axis_tready
        Input samples: one field per input port, each extended to whole bytes, the first one lowest.
    s_axis_tuser : In(flags_given)
        Flags of the sample; only if they are given.
    m_axis_tdata, m_axis_tvalid, m_axis_tready
        Output samples: one field, extended likewise.
    m_axis_tuser : Out(8)
        Status of the output sample; the bits are those of `sosmith.model.dataflow.status.Flag`.
    s_axis_tdest, m_axis_tdest
        Channel of the sample, in whole bytes; only with several channels.
    s_axil_*
        AXI4-Lite slave of a `sosmith.hdl.reload.ReloadPort`; only with a fingerprint.
    """

    def __init__(
        self,
        datapath: Datapath,
        channels: int = 1,
        fingerprint: int | None = None,
        *,
        protect: str = "none",
        adders: Sequence[Collection[int]] = (),
        flags_given: int = 0,
        before_decimator: bool = False,
    ) -> None:
        self.protect = protect
        self.adders = adders or [()] * len(datapath.stages)
        self.datapath = datapath
        self.channels = channels
        self.fingerprint = fingerprint
        self.flags_given = flags_given
        members = core_members(datapath.inputs, datapath.output, channels)
        members |= members_beside_decimator(datapath, flags_given, before=before_decimator)
        super().__init__(members if fingerprint is None else members | slave_members(ADDRESS_BITS))

    def elaborate(self, platform: object) -> Module:
        """Build the pipeline."""
        m = Module()
        m.domains.sync = ClockDomain(local=True)
        m.d.comb += [ClockSignal("sync").eq(self.aclk), ResetSignal("sync").eq(~self.aresetn)]
        guarded = self.protect != "none"
        live = min(flag_count(self.datapath) + guarded, len(self.m_axis_tuser))
        buffer = m.submodules.output_buffer = StreamBuffer(len(self.m_axis_tdata) + live + channel_bits(self.channels))
        loadable = constants(self.datapath)
        banks = None if self.fingerprint is None else ConstantBanks(self.datapath, loadable, parity=guarded)
        stages = [
            self._stage(m, stage, NO_CONSTANTS if banks is None else banks.of_stage(k), self.adders[k], buffer.advance)
            for k, stage in enumerate(self.datapath.stages)
        ]
        bank = Signal()
        waiting = Signal(2)
        guard = FaultGuard(max(1, channel_bits(self.channels))) if guarded else None
        swap = _Swap(Signal(name="pending"), Signal(name="may_swap")) if self._restarts else None
        empty = Signal()
        first, data = self._source(m, stages, (buffer.advance, bank, waiting), (guard, swap), empty)
        port = None
        if banks is not None:
            port = self._reload(m, banks, bank, Cat(waiting, *(component.uses for component in stages)), swap)
        status = self._status(data)
        last, (code, *counted) = self._chain(m, stages, first, data)
        for k in range(sum(depths(self.datapath, self.channels, self.protect))):
            held = Signal(len(status), name=f"status{k + 1}", reset_less=True)
            with m.If(buffer.advance):
                m.d.sync += held.eq(status)
            status = held
        saturated, fault = stages[-1].o_saturated, last.fault
        settling = counted[0][-1] if self.datapath.settles else Const(0, 0)
        if banks is not None and guarded:
            fault = fault | (last.valid & Mux(last.bank, banks.wrong[1], banks.wrong[0]))
        fault = fault & (last.valid | last.scrub)
        valid, channel = last.valid, last.channel
        if len(self.datapath.wear) > 1:  # it takes a clock to read the limits of the channel
            valid, code, status, saturated, channel, *flagged = self._delayed(
                m, buffer.advance, [valid, code, status, saturated, channel, *[settling] * self.datapath.settles]
            )
            settling = flagged[0] if flagged else settling
            if guarded:
                (fault,) = self._delayed(m, buffer.advance, [fault], "fault_judged")
        found = status_of_result(
            m,
            self.datapath,
            code,
            inputs=status,
            saturated=saturated,
            settling=settling,
            channel=last.channel,
            enable=buffer.advance,
            protect=self.protect,
        )
        flags = found.flags
        if guard is not None:
            fault = fault | (valid & found.failed)
            flags = Cat(flags, guard.fault | fault)
            m.submodules.guard = guard
            m.d.comb += guard.failed.eq(fault & buffer.advance)
        causes = self._causes(guard, swap)
        if causes:
            enters = (first.valid | first.scrub) & buffer.advance
            m.d.comb += empty.eq(self._restart(m, reduce(or_, causes), enters, stages, buffer.advance))
        if guard is not None and port is not None:
            self._report(m, guard, port, stages, valid & found.corrected & buffer.advance)
        self._hand_out(m, buffer, valid, code, flags if len(flags) == live else flags[:live], channel)
        return m

    def _status(self, data: Value) -> Value:
        """Return the flags that are known with a sample as it comes in."""
        given = self._given
        if given and self.channels > 1:
            given = [data[len(self.s_axis_tdata) :]]  # has been in the buffer with it
        if self.flags_given == OF_INPUT:
            return given[0]
        rail = given[0] if given else at_rail(self.datapath.inputs, data)
        return Cat(rail, outside_calibration(self.datapath, data))

    @property
    def _given(self) -> list[Value]:
        """Flags that come with a sample, if there are any."""
        return [self.s_axis_tuser] if self.flags_given else []

    @property
    def _restarts(self) -> bool:
        """Whether the core restarts with other constants."""
        return self.fingerprint is not None and self.datapath.restarts

    @staticmethod
    def _causes(guard: FaultGuard | None, swap: _Swap | None) -> list[Value]:
        """Return what clears the states, each of them for one clock."""
        return [*([] if guard is None else [guard.restart]), *([] if swap is None else [swap.now])]

    def _chain(
        self, m: Module, stages: list[PipelinedStage | InterleavedStage], first: _Place, data: Value
    ) -> tuple[_Place, list[Value]]:
        """Connect the stages one behind the other; return what is behind the last one, and its outputs."""
        place = first
        codes: list[Value] = [data[f.offset : f.offset + f.port.bits] for f in fields(self.datapath.inputs)]
        for component in stages:
            m.d.comb += [getattr(component, f"i{k}").eq(code) for k, code in enumerate(codes)]
            m.d.comb += [component.i_valid.eq(place.valid), component.i_bank.eq(place.bank)]
            following = place._replace(valid=component.o_valid, bank=component.o_bank)
            if self.protect != "none":
                m.d.comb += component.i_fault.eq(place.fault)
                following = following._replace(fault=component.o_fault)
            if isinstance(component, InterleavedStage):
                m.d.comb += component.i_channel.eq(place.channel)
                following = following._replace(channel=component.o_channel)
                if self.protect != "none":
                    m.d.comb += component.i_scrub.eq(place.scrub)
                    following = following._replace(scrub=component.o_scrub)
            place, codes = following, [getattr(component, f"o{k}") for k in range(len(component.stage.graph.outputs))]
        return place, codes

    def _hand_out(
        self, m: Module, buffer: StreamBuffer, valid: Value, code: Value, flags: Value, channel: Value
    ) -> None:
        """Pass results through the output buffer."""
        output = extended(code, len(self.m_axis_tdata))
        m.d.comb += [
            buffer.i_valid.eq(valid),
            buffer.i_data.eq(Cat(output, flags, channel)),
            self.m_axis_tvalid.eq(buffer.o_valid),
            buffer.o_ready.eq(self.m_axis_tready),
        ]
        handed = buffer.o_data[len(output) : len(output) + len(flags)]
        m.d.comb += [
            self.m_axis_tdata.eq(buffer.o_data[: len(output)]),
            self.m_axis_tuser.eq(handed if self.protect == "none" else with_fault(handed[:-1], handed[-1])),
        ]
        if self.channels > 1:
            m.d.comb += self.m_axis_tdest.eq(buffer.o_data[len(output) + len(flags) :])

    def _report(
        self,
        m: Module,
        guard: FaultGuard,
        port: ReloadPort,
        stages: list[PipelinedStage | InterleavedStage],
        corrected: Value,
    ) -> None:
        """Let the registers count what was corrected, in the stages and beside them, and what was not."""
        found = [component.corrected for component in stages if isinstance(component, InterleavedStage)]
        m.d.comb += [
            port.corrected.eq(Cat(*found, corrected).any()),
            port.failed.eq(guard.failed),
            guard.acknowledge.eq(port.acknowledge),
        ]

    def _restart(
        self,
        m: Module,
        clears: Value,
        enters: Value,
        stages: list[PipelinedStage | InterleavedStage],
        advance: Value,
    ) -> Signal:
        """Clear registers at the clock of a restart; return whether the pipeline is empty, so that one may begin.

        `enters` is whether a sample or a scrub is taken by the first stage at this clock.
        """
        remaining = Signal(range(self._depth + 1))
        with m.If(enters):
            m.d.sync += remaining.eq(self._depth)
        with m.Elif(advance & remaining.any()):
            m.d.sync += remaining.eq(remaining - 1)
        for component in stages:
            if isinstance(component, PipelinedStage):
                m.d.comb += component.clear.eq(clears)
        empty = Signal()
        m.d.comb += empty.eq(~remaining.any())
        return empty

    @property
    def _depth(self) -> int:
        """Clocks of the pipeline from the first stage to the output buffer."""
        return sum(depths(self.datapath, self.channels, self.protect)) + (len(self.datapath.wear) > 1)

    def _delayed(self, m: Module, advance: Value, values: list[Value], name: str = "judged") -> list[Value]:
        """Return the values a clock of the pipeline later; the first is the valid bit, which alone is reset."""
        later = [Signal(value.shape(), name=f"{name}{k}", reset_less=k > 0) for k, value in enumerate(values)]
        with m.If(advance):
            m.d.sync += [register.eq(value) for register, value in zip(later, values, strict=True)]
        return list(later)

    def _stage(
        self, m: Module, stage: Stage, constants: Mapping[int, Pair], adders: Collection[int], advance: Value
    ) -> PipelinedStage | InterleavedStage:
        several = self.channels > 1
        component = (
            InterleavedStage(stage, self.channels, constants, protect=self.protect, adders=adders)
            if several
            else PipelinedStage(stage, constants, parity=self.protect != "none", clears=self._restarts, adders=adders)
        )
        m.submodules[stage.name] = component
        m.d.comb += component.advance.eq(advance)
        return component

    def _reload(self, m: Module, banks: ConstantBanks, bank: Signal, uses: Value, swap: _Swap | None) -> ReloadPort:
        """Connect the reload port to the banks, and return it.

        `uses` are pairs of bits: whether samples use bank 0, and bank 1.
        """
        assert self.fingerprint is not None
        m.submodules.constant_banks = banks
        m.submodules.reload_port = port = ReloadPort(
            banks.words, design=self.fingerprint, protected=self.protect != "none"
        )
        forward_slave(m, self, port)
        m.d.comb += [
            bank.eq(port.bank),
            port.may_swap.eq(1 if swap is None else swap.may),
            port.shadow_free.eq(~Mux(port.bank, uses[::2].any(), uses[1::2].any())),
            banks.write_enable.eq(port.write_enable),
            banks.write_bank.eq(~port.bank),
            banks.write_address.eq(port.write_address),
            banks.write_data.eq(port.write_data),
        ]
        if swap is not None:
            m.d.comb += swap.pending.eq(port.pending)
        return port

    def _source(
        self,
        m: Module,
        stages: list[PipelinedStage | InterleavedStage],
        control: tuple[Value, Value, Signal],
        restarts: tuple[FaultGuard | None, _Swap | None],
        empty: Value,
    ) -> tuple[_Place, Value]:
        """Return what is there for the first stage, and the sample's codes.

        The control is `advance`; the bank of samples accepted now;
        and a signal that is driven with the banks that waiting samples use. `empty` is whether the pipeline is.
        """
        (advance, bank, waiting), (guard, swap) = control, restarts
        interleaved = [component for component in stages if isinstance(component, InterleavedStage)]
        if not interleaved:
            blocks = [*([] if guard is None else [guard.broken]), *([] if swap is None else [swap.pending])]
            if not blocks:
                m.d.comb += self.s_axis_tready.eq(advance)
                return _Place(self.s_axis_tvalid, Const(0, 0), bank), self.s_axis_tdata
            open_ = ~reduce(or_, blocks)
            m.d.comb += self.s_axis_tready.eq(advance & open_)
            if guard is not None:
                m.d.comb += guard.idle.eq(guard.broken & empty)
            if swap is not None:
                m.d.comb += swap.may.eq(empty)
            return _Place(self.s_axis_tvalid & open_, Const(0, 0), bank), self.s_axis_tdata
        bits = channel_bits(self.channels)
        buffer = m.submodules.input_buffer = StreamBuffer(len(self.s_axis_tdata) + self.flags_given + bits + 1)
        clearing = Signal(init=1)
        cleared = Signal(bits)
        exists = self.s_axis_tdest < self.channels
        dest: Value = buffer.o_data[:bits]
        scrubs: Value = Const(0, 1)
        if guard is not None:
            dest = Mux(buffer.o_valid, dest, guard.address)
            scrubs = guard.scrubs & (guard.address < self.channels)
        for cause in self._causes(guard, swap):
            with m.If(cause):
                m.d.sync += [clearing.eq(1), cleared.eq(0)]
        with m.If(clearing):
            m.d.sync += cleared.eq(cleared + 1)
            with m.If(cleared == self.channels - 1):
                m.d.sync += clearing.eq(0)
        # Samples whose states may not have been written yet: as many of the last ones as the slowest stage asks.
        waits: Value = Const(0, 1)
        near: list[tuple[Value, Value]] = []
        distance = max(component.schedule.distance for component in interleaved)
        valid = Signal()
        for k in range(distance - 1):
            before = near[-1] if near else (valid if guard is None else valid | scrubs, dest)
            taken, channel = Signal(name=f"near{k}"), Signal(bits, name=f"near_channel{k}", reset_less=True)
            with m.If(advance):
                m.d.sync += [taken.eq(before[0]), channel.eq(before[1])]
            near.append((taken, channel))
            waits = waits | (taken & (channel == dest))
        moves = ~waits if guard is None else ~waits & ~(guard.broken | clearing)
        shut: Value = clearing if swap is None else clearing | swap.pending
        m.d.comb += [
            self.s_axis_tready.eq(buffer.advance & ~shut),
            buffer.i_valid.eq(self.s_axis_tvalid & exists & ~shut),
            buffer.i_data.eq(Cat(self.s_axis_tdest[:bits], bank, self.s_axis_tdata, *self._given)),
            waiting.eq(banks_in_use([buffer.o_valid, ~buffer.advance], [buffer.o_data[bits], buffer.o_next[bits]])),
            valid.eq(buffer.o_valid & moves),
            buffer.o_ready.eq(advance & moves),
        ]
        if guard is not None:
            free = advance & moves & ~buffer.o_valid
            if swap is not None:
                free = free & ~swap.pending  # a scrub is inside like a sample
            m.d.comb += guard.idle.eq(Mux(guard.broken, empty, free))
        if swap is not None:
            m.d.comb += swap.may.eq(empty & ~buffer.o_valid & ~clearing)
        for component in interleaved:
            m.d.comb += [component.clear.eq(clearing), component.clear_channel.eq(cleared)]
        return _Place(valid, dest, buffer.o_data[bits], scrubs), buffer.o_data[bits + 1 :]
