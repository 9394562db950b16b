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
from dataclasses import dataclass
from functools import reduce
from operator import or_
from typing import NamedTuple

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import data

from sosmith.hdl.axi_stream import StreamBuffer
from sosmith.hdl.constant_banks import NO_CONSTANTS, ConstantBanks, Pair
from sosmith.hdl.pipelined_logic import banks_in_use
from sosmith.hdl.plan.parallel_clocks import depths
from sosmith.hdl.plan.streams import channel_bits
from sosmith.hdl.reload import ReloadPort
from sosmith.hdl.shell.bank_pins import BankPins
from sosmith.hdl.shell.fault_guard import FaultGuard
from sosmith.hdl.shell.pipeline import Sample, delayed, through
from sosmith.hdl.shell.shell import Shell
from sosmith.hdl.stages.interleaved import InterleavedStage
from sosmith.hdl.stages.pipelined import PipelinedStage
from sosmith.hdl.stages.shared import SharedStage
from sosmith.hdl.stages.starting import StartingStage
from sosmith.hdl.status import NEVER, status_of_result, with_fault
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.structure import Stage
from sosmith.model.reload.constants import constants
from sosmith.model.sections.start import PassingStage, StartStage

AnyStage = PipelinedStage | InterleavedStage | SharedStage
"""What a stage of a datapath, or several sections, are in hardware."""


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


@dataclass(frozen=True)
class Parts:
    """What a core is made of.

    Attributes
    ----------
    advance : Value
        Whether the pipeline moves.
    stages : sequence of AnyStage
        The stages.
    banks : ConstantBanks or None
        Constants that can be loaded.
    bank, waiting : Signal
        The bank of samples accepted now, and the banks that samples before the first stage use.
    guard, swap : FaultGuard, _Swap or None
        What restarts the core.
    empty : Signal
        Whether the pipeline is, if anything restarts the core.
    """

    advance: Value
    stages: Sequence[AnyStage]
    banks: ConstantBanks | None
    bank: Signal
    waiting: Signal
    guard: FaultGuard | None
    swap: _Swap | None
    empty: Signal

    @property
    def interleaved(self) -> list[InterleavedStage]:
        """The stages for several channels."""
        return [stage for stage in self.stages if isinstance(stage, InterleavedStage)]

    @property
    def causes(self) -> list[Value]:
        """What clears the states, each of them for one clock."""
        return [*([] if self.guard is None else [self.guard.restart]), *([] if self.swap is None else [self.swap.now])]

    @property
    def blocks(self) -> list[Value]:
        """What keeps samples from entering."""
        guard, swap = self.guard, self.swap
        return [*([] if guard is None else [guard.broken]), *([] if swap is None else [swap.pending])]


class _Result(NamedTuple):
    """What leaves the last stage."""

    valid: Value
    code: Value
    inputs: Value
    saturated: Value
    channel: Value
    settling: Value

    def later(self, m: Module, advance: Value) -> _Result:
        """Return the same a clock of the pipeline later; the valid bit alone is reset."""
        registers = [
            Signal(value.shape(), name=f"judged{k}", reset_less=k > 0) if len(value) else value
            for k, value in enumerate(self)
        ]
        with m.If(advance):
            m.d.sync += [register.eq(value) for register, value in zip(registers, self, strict=True) if len(value)]
        return _Result(*registers)


class Core(Shell):
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
    lock : bool
        Whether loading can be locked until a reset.
    adders : sequence of collection of int
        Products by constants that are made of adders, by stage and node; only without a fingerprint.
    flags_given : int
        How many flags of the inputs come with a sample, from a decimator, and are not read off its codes: the first of
        `sosmith.model.dataflow.status.Flag`.
    before_decimator : bool
        Whether its results go to a decimator.
    pins : (int, int) or None
        Words of a bank and bits of each, if constants are loaded at pins; None if the core has its own registers.

    Members
    -------
    aclk, aresetn, s_axis_*, m_axis_*, s_axil_*, reload_*
        As those of `sosmith.hdl.shell.shell.Shell`.
    """

    def __init__(
        self,
        datapath: Datapath,
        channels: int = 1,
        fingerprint: int | None = None,
        *,
        protect: str = "none",
        lock: bool = False,
        adders: Sequence[Collection[int]] = (),
        flags_given: int = 0,
        before_decimator: bool = False,
        pins: tuple[int, int] | None = None,
    ) -> None:
        self.adders = adders or [()] * len(datapath.stages)
        super().__init__(
            datapath,
            channels,
            fingerprint,
            protect=protect,
            lock=lock,
            flags_given=flags_given,
            before_decimator=before_decimator,
            pins=pins,
        )

    def fill(self, m: Module) -> None:
        """Build the pipeline."""
        buffer = self.output_buffer(m)
        parts = self._parts(m, buffer.advance)
        first, tdata, given = self._source(m, parts)
        port = self._reload_port(m, parts)
        inputs = self.status_of_inputs(tdata, given)
        last, (code, *counted) = through(m, parts.stages, first, self.codes(tdata))
        result = _Result(
            last.valid,
            code,
            delayed(m, buffer.advance, inputs, self._depth_of_stages, "status"),
            parts.stages[-1].o_saturated,
            last.channel,
            counted[0][-1] if self.datapath.settles else Const(0, 0),
        )
        fault = self._fault_of(m, parts, last)
        if self._reads_limits:
            result = result.later(m, buffer.advance)
        status = status_of_result(
            m,
            self.datapath,
            result.code,
            inputs=result.inputs,
            saturated=result.saturated,
            settling=result.settling,
            channel=last.channel,
            enable=buffer.advance,
            protect=self.protect,
        )
        flags = status.flags
        if parts.guard is not None:
            fault = fault | (result.valid & status.failed)
            flags = with_fault(flags, parts.guard.fault | fault)
            m.submodules.guard = parts.guard
            corrected = Cat(
                *(stage.corrected for stage in parts.interleaved), result.valid & status.corrected & buffer.advance
            )
            found = corrected.any(), fault & buffer.advance
            self.report(m, parts.guard, port, found, Const(1, 1))
        self._restart(m, parts, first)
        self.hand_out(m, buffer, result.valid, [(result.code, flags)], result.channel)

    def _parts(self, m: Module, advance: Value) -> Parts:
        """Make stages, and what loads and guards them."""
        loadable = None if self.fingerprint is None else constants(self.datapath)
        banks = None if loadable is None else ConstantBanks(self.datapath, loadable, parity=self.is_guarded)
        stages = self._stages(banks)
        for stage in stages:
            m.submodules[stage.name] = stage
            m.d.comb += stage.advance.eq(advance)
        return Parts(
            advance,
            stages,
            banks,
            bank=Signal(name="bank"),
            waiting=Signal(2, name="waiting"),
            guard=FaultGuard(max(1, channel_bits(self.channels))) if self.is_guarded else None,
            swap=_Swap(Signal(name="pending"), Signal(name="may_swap")) if self.restarts else None,
            empty=Signal(name="empty"),
        )

    def _stages(self, banks: ConstantBanks | None) -> Sequence[AnyStage]:
        """Make the stages."""
        stages: list[AnyStage] = []
        for k, (stage, adders) in enumerate(zip(self.datapath.stages, self.adders, strict=True)):
            pairs = NO_CONSTANTS if banks is None else banks.of_stage(k)
            if self.channels > 1:
                stages.append(InterleavedStage(stage, self.channels, pairs, protect=self.protect, adders=adders))
            else:
                stages.append(self._stage_of_one(stage, pairs, adders))
        return stages

    def _stage_of_one(self, stage: Stage, pairs: Mapping[int, Pair], adders: Collection[int]) -> PipelinedStage:
        """Make a stage for one channel; the first sample is kept once, but where each sample has to check it."""
        if not self.is_guarded:
            if isinstance(stage, StartStage):
                return StartingStage(stage, clears=self.restarts)
            if isinstance(stage, PassingStage):
                stage = stage.section
        return PipelinedStage(stage, pairs, parity=self.is_guarded, clears=self.restarts, adders=adders)

    @property
    def _depth_of_stages(self) -> int:
        return sum(depths(self.datapath, self.channels, self.protect, self.adders))

    @property
    def _reads_limits(self) -> bool:
        """Whether each channel has limits of wear of its own: it takes a clock to read them."""
        return len(self.datapath.wear) > 1

    def _fault_of(self, m: Module, parts: Parts, last: Sample) -> Value:
        """Return whether a wrong bit was found for a result, when its flags are known."""
        fault = last.fault
        if not self.is_guarded:
            return fault
        if parts.banks is not None:
            fault = fault | (last.valid & Mux(last.bank, parts.banks.wrong[1], parts.banks.wrong[0]))
        fault = fault & (last.valid | last.scrub)
        if not self._reads_limits:
            return fault
        judged = Signal(name="fault_judged0")
        with m.If(parts.advance):
            m.d.sync += judged.eq(fault)
        return judged

    def _restart(self, m: Module, parts: Parts, first: Sample) -> None:
        """Clear registers at the clock of a restart, which may begin when the pipeline is empty."""
        if not parts.causes:
            return
        depth = self._depth_of_stages + self._reads_limits
        remaining = Signal(range(depth + 1))
        with m.If((first.valid | first.scrub) & parts.advance):
            m.d.sync += remaining.eq(depth)
        with m.Elif(parts.advance & remaining.any()):
            m.d.sync += remaining.eq(remaining - 1)
        clears = reduce(or_, parts.causes)
        for stage in parts.stages:
            if isinstance(stage, PipelinedStage):
                m.d.comb += stage.clear.eq(clears)
        m.d.comb += parts.empty.eq(~remaining.any())

    def _reload_port(self, m: Module, parts: Parts) -> ReloadPort | BankPins | None:
        """Make the reload port of the banks, and connect them."""
        banks, swap = parts.banks, parts.swap
        if banks is None or self.fingerprint is None:
            return None
        uses = Cat(parts.waiting, *(stage.uses for stage in parts.stages))  # pairs: of bank 0, of bank 1
        m.submodules.constant_banks = banks
        port = (
            BankPins(*self.pins)
            if self.pins
            else ReloadPort(banks.words, design=self.fingerprint, protected=self.is_guarded, lock=self.lock)
        )
        self.join_port(m, port)
        m.d.comb += [
            parts.bank.eq(port.bank),
            port.may_swap.eq(1 if swap is None else swap.may),
            port.shadow_free.eq(~Mux(port.bank, uses[::2].any(), uses[1::2].any())),
            banks.write_enable.eq(port.write_enable),
            banks.write_bank.eq(~port.bank),
            banks.write_address.eq(port.write_address),
            banks.write_data.eq(port.write_data),
        ]
        if swap is not None and isinstance(port, ReloadPort):
            m.d.comb += swap.pending.eq(port.pending)
        return port

    def _source(self, m: Module, parts: Parts) -> tuple[Sample, Value, Value | None]:
        """Return what is there for the first stage, its codes as on `s_axis_tdata`, and the flags given with it."""
        if self.channels > 1:
            return self._source_of_channels(m, parts)
        valid: Value = self.s_axis_tvalid
        ready = parts.advance
        if parts.blocks:
            open_ = ~reduce(or_, parts.blocks)
            valid, ready = valid & open_, ready & open_
        m.d.comb += self.s_axis_tready.eq(ready)
        if parts.guard is not None:
            m.d.comb += parts.guard.idle.eq(parts.guard.broken & parts.empty)
        if parts.swap is not None:
            m.d.comb += parts.swap.may.eq(parts.empty)
        sample = Sample(valid, parts.bank, fault=self.given_fault)
        return sample, self.s_axis_tdata, self.given_flags if self.flags_given else None

    def _source_of_channels(self, m: Module, parts: Parts) -> tuple[Sample, Value, Value | None]:
        """Return the same of several channels, from behind an input buffer where samples wait for those before."""
        guard, swap, advance = parts.guard, parts.swap, parts.advance
        bits = channel_bits(self.channels)
        word = {
            "channel": self.s_axis_tdest[:bits],
            "bank": parts.bank,
            "tdata": self.s_axis_tdata,
            "given": self.given_flags if self.flags_given else Const(0, 0),
            "fault": self.given_fault if self.flags_given and self.is_guarded else Const(0, 0),
        }
        layout = data.StructLayout({name: len(value) for name, value in word.items()})
        buffer = m.submodules.input_buffer = StreamBuffer(layout.size)
        head, next_ = data.View(layout, buffer.o_data), data.View(layout, buffer.o_next)
        exists = self.s_axis_tdest < self.channels
        channel: Value = head.channel
        scrubs = NEVER
        if guard is not None:
            channel = Mux(buffer.o_valid, channel, guard.address)
            scrubs = guard.scrubs & (guard.address < self.channels)
        clearing, cleared = self._clear_channels(m, parts)
        valid = Signal()
        moves = ~self._waits(m, parts, valid if guard is None else valid | scrubs, channel)
        if guard is not None:
            moves = moves & ~(guard.broken | clearing)
        shut: Value = clearing if swap is None else clearing | swap.pending
        m.d.comb += [
            self.s_axis_tready.eq(buffer.advance & ~shut),
            buffer.i_valid.eq(self.s_axis_tvalid & exists & ~shut),
            buffer.i_data.eq(Cat(*word.values())),
            parts.waiting.eq(banks_in_use([buffer.o_valid, ~buffer.advance], [head.bank, next_.bank])),
            valid.eq(buffer.o_valid & moves),
            buffer.o_ready.eq(advance & moves),
        ]
        if guard is not None:
            free = advance & moves & ~buffer.o_valid
            if swap is not None:
                free = free & ~swap.pending  # a scrub is inside like a sample
            m.d.comb += guard.idle.eq(Mux(guard.broken, parts.empty, free))
        if swap is not None:
            m.d.comb += swap.may.eq(parts.empty & ~buffer.o_valid & ~clearing)
        for stage in parts.interleaved:
            m.d.comb += [stage.clear.eq(clearing), stage.clear_channel.eq(cleared)]
        fault = head.fault & buffer.o_valid if self.flags_given and self.is_guarded else NEVER
        sample = Sample(valid, head.bank, fault=fault, channel=channel, scrub=scrubs)
        return sample, head.tdata, head.given if self.flags_given else None

    def _clear_channels(self, m: Module, parts: Parts) -> tuple[Signal, Signal]:
        """Clear the states of all channels after a reset or restart; return whether it goes on, and the channel."""
        clearing = Signal(init=1)
        cleared = Signal(channel_bits(self.channels))
        for cause in parts.causes:
            with m.If(cause):
                m.d.sync += [clearing.eq(1), cleared.eq(0)]
        with m.If(clearing):
            m.d.sync += cleared.eq(cleared + 1)
            with m.If(cleared == self.channels - 1):
                m.d.sync += clearing.eq(0)
        return clearing, cleared

    @staticmethod
    def _waits(m: Module, parts: Parts, enters: Value, channel: Value) -> Value:
        """Return whether the sample in front must wait, as the states of its channel may not have been written yet.

        They may not if it is the channel of one of the last samples, of as many as the slowest stage asks.
        """
        waits: Value = Const(0, 1)
        before = enters, channel
        for k in range(max(stage.schedule.distance for stage in parts.interleaved) - 1):
            taken, near = Signal(name=f"near{k}"), Signal(len(channel), name=f"near_channel{k}", reset_less=True)
            with m.If(parts.advance):
                m.d.sync += [taken.eq(before[0]), near.eq(before[1])]
            before = taken, near
            waits = waits | (taken & (near == channel))
        return waits
