r"""A core behind a decimator: a CIC filter that hands on one sample out of R, and the core that takes it.

N integrators and N combs of `width` bits, one adder each, with a register behind every one of them::

    s_axis --> [+ sum1] --> .. N .. --> [+ sumN] --> [- comb1] --> .. N .. --> [- combN] --> + --> [o_data] --> core
     bits   |    width                    width        width                     width      half    width - dropped
            |                                                                                         |
            +--> at_rail --> [rail], of any sample since the last result ---------------------------> s_axis_tuser

    clock of the edge        0         1     ..    N-1           N        ..      2N-1        2N
    register                sum1      sum2   ..    sumN       difference1 ..  differenceN    o_data, o_valid

Each stage holds what belongs to one sample, and has a valid bit; the combs move with every R-th sample only. All sums
are modulo ``2**width``, see `sosmith.model.dataflow.decimator`.

The first sample after a reset is offered for ``N R`` clocks before it is accepted, and goes in at each of them: after
that the filter is as if it had been there for ever. Nothing that the sums or combs held before counts any more. With a
start from zero, a reset clears sums and combs instead, and nothing is filled.

A sample that completes a result is not accepted before the core has taken the result before; all others are, one a
clock. `s_axis_tready` comes from registers only.

With protection, each sum and comb has a parity bit, [sum1_parity] and so on, which is compared at every clock, and
`sosmith.hdl.shell.kept` holds the phase and the flags since the last result. A wrong bit in a sum or a comb is
forgotten: once N combs hold what came after it, no result has it any more. So nothing is cleared, and no phase is lost.
The result that may be inside and the N after it have `o_fault`, with which the core behind restarts, the last time for
the first result that no wrong bit reaches::

    wrong ---> [marked] = N + 1 ---> one less with each result ---> any: [o_fault]

A calibration is a core of its own before all this, which works on every sample::

    s_axis --> ahead (calibration) --> CIC filter --> core --> m_axis
                      flags of the inputs: any since the last result

The first sample goes into it before it is accepted, and waits behind it while the decimator fills::

    s_axis_tvalid  _/~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~\_
    [first]        ~~~~\______________________________   goes into the calibration
    [fills]        ____/~~~~~~~~~~~~~~~~~~~~~~~~~~\____   its result is offered to the decimator
    s_axis_tready  ______________________________/~\__   has been accepted there
"""

from __future__ import annotations

from amaranth.hdl import Cat, ClockDomain, ClockSignal, Const, DomainRenamer, Module, ResetSignal, Signal, Value
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from sosmith.hdl.axi_stream import codes_of, core_members, extended
from sosmith.hdl.bus.axi_lite import forward_slave, slave_members
from sosmith.hdl.cores.folded import FoldedCore
from sosmith.hdl.cores.parallel import Core
from sosmith.hdl.decimation.channel_decimator import ChannelDecimator
from sosmith.hdl.plan.streams import width
from sosmith.hdl.shell.kept import Kept
from sosmith.hdl.status import NEVER, OF_INPUT, at_rail
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.decimator import Decimator
from sosmith.model.dataflow.status import Flag
from sosmith.model.reload.registers import ADDRESS_BITS


class CicDecimator(wiring.Component):
    """A CIC filter between two streams.

    Latency and throughput: those of `sosmith.hdl.plan.decimator_clocks`; one sample a clock between results.

    Parameters
    ----------
    decimator : Decimator
        What it computes.
    flags : int
        How many flags come with a sample; 0 to find out whether it is at the end of its range.
    guarded : bool
        Whether each sum and comb has a parity bit, and what counts samples corrects a wrong bit.

    Members
    -------
    i_data, i_valid, i_ready
        Samples at the higher rate, by the rules of AXI4-Stream; `i_data` is as wide as on a core's stream, or, with
        flags, as the code.
    i_flags
        Flags of a sample; only if there are any.
    i_fault, o_fault
        Whether a wrong bit was found for a sample, and whether one may have changed a result; only if guarded, the
        first one with flags.
    corrected
        Whether a wrong bit is corrected at this clock; only if guarded.
    o_data, o_rail, o_valid, o_ready
        Results: the code of `decimator.output`, and whether a sample since the result before was at the end of its
        range.
    o_flags
        In place of `o_rail`: the flags of any sample since the result before.
    """

    def __init__(self, decimator: Decimator, flags: int = 0, *, guarded: bool = False) -> None:
        self.decimator = decimator
        self.flags = flags
        self.guarded = guarded
        flag_ports = {"i_flags": In(flags), "o_flags": Out(flags)} if flags else {"o_rail": Out(1)}
        if guarded:
            flag_ports |= {"o_fault": Out(1), "corrected": Out(1), **({"i_fault": In(1)} if flags else {})}
        super().__init__(
            {
                "i_data": In(decimator.input.bits if flags else width([decimator.input])),
                "i_valid": In(1),
                "i_ready": Out(1),
                "o_data": Out(decimator.output.bits),
                **flag_ports,
                "o_valid": Out(1),
                "o_ready": In(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        """Build control, integrators and combs."""
        m = Module()
        cic = self.decimator
        gathered = {"found": self.flags} if self.flags else {"rail": 1}
        kept = Kept(m, {"phase": cic.factor.bit_length() - 1, **gathered}, guarded=self.guarded)
        phase = kept.values["phase"]
        waiting = Signal()
        completes = Signal()
        enters = Signal()
        filling = self._fill(m, enters & phase.all()) if cic.steady else Const(0, 1)
        m.d.comb += [
            completes.eq(~phase.any()),
            self.i_ready.eq(~filling & ~(waiting & completes)),
            enters.eq(self.i_valid & (filling | self.i_ready)),
        ]
        with m.If(enters):
            kept.load("phase", phase + 1)  # the factor is a power of two
        with m.If(enters & completes & ~filling):
            m.d.sync += waiting.eq(1)
        with m.Elif(self.o_valid & self.o_ready):
            m.d.sync += waiting.eq(0)
        if self.flags:
            self._gather(m, kept, enters & ~filling, completes)
        else:
            self._flag_rails(m, kept, enters & ~filling, completes)
        value, moves, counts, wrong = self._filter(m, enters, completes, ~filling)
        if self.guarded:
            given = enters & self.i_fault if self.flags else NEVER
            self._mark(m, Cat(wrong, kept.failed, given).any(), moves & counts)
            m.d.comb += self.corrected.eq(kept.corrected)
        with m.If(moves & counts):
            m.d.sync += [self.o_data.eq((value + (1 << cic.dropped >> 1)) >> cic.dropped), self.o_valid.eq(1)]
        with m.Elif(self.o_ready):
            m.d.sync += self.o_valid.eq(0)
        return m

    def _fill(self, m: Module, ends: Value) -> Signal:
        """Return whether the first sample still fills the filter, from the last of each R times that it goes in."""
        cic = self.decimator
        filling = Signal(init=1, name="filling")
        filled = Signal(range(cic.stages + 1), name="filled")
        with m.If(ends):
            m.d.sync += filled.eq(filled + 1)
            with m.If(filled == cic.stages - 1):
                m.d.sync += filling.eq(0)
        return filling

    def _flag_rails(self, m: Module, kept: Kept, accepted: Value, completes: Value) -> None:
        """Hold whether any sample of a result is at the end of the range, from the last of them on."""
        at_end = at_rail([self.decimator.input], self.i_data)
        rail = kept.values["rail"]
        with m.If(accepted):
            kept.load("rail", (rail | at_end) & ~completes)
            with m.If(completes):
                m.d.sync += self.o_rail.eq(rail | at_end)

    def _gather(self, m: Module, kept: Kept, accepted: Value, completes: Value) -> None:
        """Hold the flags of all samples of a result, from the last of them on."""
        found = kept.values["found"]
        with m.If(accepted):
            kept.load("found", found | self.i_flags)
            with m.If(completes):
                m.d.sync += self.o_flags.eq(found | self.i_flags)
                kept.load("found", 0)

    def _mark(self, m: Module, wrong: Value, gives: Value) -> None:
        """Mark the results that a wrong bit may reach: the one that may be inside, and N more."""
        marked = Signal(range(self.decimator.stages + 2))
        with m.If(gives):
            m.d.sync += [self.o_fault.eq(wrong | marked.any()), marked.eq(marked - marked.any())]
        with m.If(wrong):
            m.d.sync += marked.eq(self.decimator.stages + 1)

    def _filter(self, m: Module, enters: Value, completes: Value, counts: Value) -> tuple[Value, Value, Value, Value]:
        """Integrate and comb.

        Return the difference behind the last comb, whether it is new, whether it counts, and whether a state is wrong.
        """
        cic = self.decimator
        (code,) = codes_of([cic.input], self.i_data)
        value: Value = Signal(cic.width, name="code")
        m.d.comb += value.eq(extended(code, cic.width))
        # From zero, every result counts.
        valid, last, *real = (enters, completes, counts) if cic.steady else (enters, completes)
        wrong: list[Value] = []
        reset_less = cic.steady and not self.guarded  # a parity bit must be that of what is there
        for k in range(1, cic.stages + 1):
            total = Signal(cic.width, name=f"sum{k}", reset_less=reset_less)
            with m.If(valid):
                m.d.sync += total.eq(total + value)
            wrong += self._check(m, total, total + value, valid)
            value = total
            valid, last, *real = self._later(m, f"integrator{k}", valid, last, *real)
        moves = valid & last
        for k in range(1, cic.stages + 1):
            before = Signal(cic.width, name=f"comb{k}", reset_less=reset_less)
            difference = Signal(cic.width, name=f"difference{k}", reset_less=True)
            with m.If(moves):
                m.d.sync += [difference.eq(value - before), before.eq(value)]
            wrong += self._check(m, before, value, moves)
            value = difference
            moves, *real = self._later(m, f"comb{k}", moves, *real)
        return value, moves, real[0] if real else Const(1, 1), Cat(*wrong).any()

    def _check(self, m: Module, state: Signal, following: Value, loads: Value) -> list[Value]:
        """Give a state a parity bit if it is guarded; return whether it is wrong at this clock."""
        if not self.guarded:
            return []
        parity = Signal(name=f"{state.name}_parity")
        with m.If(loads):
            m.d.sync += parity.eq(following[: len(state)].xor())
        return [state.xor() ^ parity]

    def _later(self, m: Module, name: str, valid: Value, *others: Value) -> tuple[Value, ...]:
        """Return bits of the control a clock later; the first, the valid bit, is 0 from a reset on."""
        registers = [Signal(1, name=f"{name}_control{k}", reset_less=k > 0) for k in range(1 + len(others))]
        m.d.sync += [register.eq(bit) for register, bit in zip(registers, (valid, *others), strict=True)]
        return tuple(registers)


class Holder(wiring.Component):
    """Hands out each word several times.

    ::

        i_data --> [o_data] --> o_data        [left] counts down from copies - 1 with each word that leaves
        i_ready <-- the register is free, or its last copy leaves at this clock

    Latency: one clock. Throughput: one word for each `copies` of clocks.

    Parameters
    ----------
    width : int
        Width of a word, in bits.
    copies : int
        Times that each word is handed out, at least 2.

    Members
    -------
    i_data, i_valid, i_ready, o_data, o_valid, o_ready
        Words before and behind it, by the rules of AXI4-Stream.
    """

    def __init__(self, width: int, copies: int) -> None:
        self.copies = copies
        super().__init__(
            {
                "i_data": In(width),
                "i_valid": In(1),
                "i_ready": Out(1),
                "o_data": Out(width),
                "o_valid": Out(1),
                "o_ready": In(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        """Build the register and its counter."""
        m = Module()
        left = Signal(range(self.copies), reset_less=True)
        held = Signal(len(self.o_data), reset_less=True)
        m.d.comb += [self.i_ready.eq(~self.o_valid | (self.o_ready & ~left.any())), self.o_data.eq(held)]
        with m.If(self.i_ready):
            m.d.sync += [held.eq(self.i_data), self.o_valid.eq(self.i_valid), left.eq(self.copies - 1)]
        with m.Elif(self.o_ready):
            m.d.sync += left.eq(left - 1)
        return m


class DecimatedCore(wiring.Component):
    """A core with a decimator before it, before that a calibration, and behind it a `Holder` if results are held.

    Latency: that of each of them, and a clock of the holder. Throughput: one sample a clock, or what the calibration
    takes, as long as the core keeps up with one result for each R of them.

    Parameters
    ----------
    datapath : Datapath
        With a decimator; its name is that of the top module.
    core : Core or FoldedCore
        The core for `datapath.behind_decimator`, which takes flags of the inputs from `s_axis_tuser`.
    calibration : Core or FoldedCore or None
        The core for `datapath.calibration`, whose results go to the decimator; None without one.
    hold : bool
        Whether each result is handed out once for each of its samples.
    opens : int
        Clocks after a reset before a sample is let in, with several channels: while the core clears its memories.

    Members
    -------
    aclk, aresetn, s_axis_*, m_axis_*, s_axil_*
        As in `sosmith.hdl.cores.parallel.Core`; the registers are those of `core`.
    """

    def __init__(
        self,
        datapath: Datapath,
        core: Core | FoldedCore,
        calibration: Core | FoldedCore | None = None,
        *,
        hold: bool = False,
        opens: int = 0,
    ) -> None:
        self.datapath = datapath
        self.calibration = calibration
        self.opens = opens
        self.hold = hold
        self.core = core
        self.channels = core.channels
        members = core_members(datapath.inputs, datapath.output, self.channels)
        super().__init__(members if core.fingerprint is None else members | slave_members(ADDRESS_BITS))

    def elaborate(self, platform: object) -> Module:
        """Connect decimator and core."""
        m = Module()
        assert self.datapath.decimator is not None
        m.domains.front = ClockDomain(local=True)  # the core has its own domain `sync`
        m.d.comb += [ClockSignal("front").eq(self.aclk), ResetSignal("front").eq(~self.aresetn)]
        flags = 0 if self.calibration is None else OF_INPUT
        several, core, cic = self.channels > 1, self.core, self.datapath.decimator
        decimator = (
            ChannelDecimator(cic, self.channels, flags, protect=core.protect)
            if several
            else CicDecimator(cic, flags, guarded=core.is_guarded)
        )
        if self.calibration is not None:
            m.submodules.ahead = self.calibration
        m.submodules.decimator = DomainRenamer("front")(decimator)
        m.submodules.behind = core
        forward_slave(m, self, core)
        if self.calibration is not None:
            self._connect_calibration(m, self.calibration, decimator)
        else:
            m.d.comb += decimator.i_data.eq(self.s_axis_tdata)
            if several:
                self._open(m, decimator.i_valid, decimator.i_ready)
            else:
                m.d.comb += [decimator.i_valid.eq(self.s_axis_tvalid), self.s_axis_tready.eq(decimator.i_ready)]
        if isinstance(decimator, ChannelDecimator):
            source = self.s_axis_tdest if self.calibration is None else self.calibration.m_axis_tdest
            m.d.comb += [decimator.i_dest.eq(source), core.s_axis_tdest.eq(decimator.o_dest)]
        told = decimator.o_flags if flags or several else decimator.o_rail
        m.d.comb += [
            core.aclk.eq(self.aclk),
            core.aresetn.eq(self.aresetn),
            core.s_axis_tdata.eq(decimator.o_data),
            core.s_axis_tuser.eq(Cat(told, decimator.o_fault) if core.is_guarded else told),
            core.s_axis_tvalid.eq(decimator.o_valid),
            decimator.o_ready.eq(core.s_axis_tready),
        ]
        if core.is_guarded:
            before = Const(0, 1) if self.calibration is None else self.calibration.o_corrected
            m.d.comb += core.i_corrected.eq(decimator.corrected | before)
        word = {"data": core.m_axis_tdata, "user": core.m_axis_tuser}
        if several:
            word["dest"] = core.m_axis_tdest
        result: Value = Cat(*word.values())
        valid, ready = core.m_axis_tvalid, self.m_axis_tready
        if self.hold:
            holder = Holder(len(result), self.datapath.decimator.factor)
            m.submodules.holder = DomainRenamer("front")(holder)
            m.d.comb += [holder.i_data.eq(result), holder.i_valid.eq(valid), holder.o_ready.eq(ready)]
            result, valid, ready = holder.o_data, holder.o_valid, holder.i_ready
        handed = data.View(data.StructLayout({name: len(value) for name, value in word.items()}), result)
        if several:
            m.d.comb += self.m_axis_tdest.eq(handed.dest)
        m.d.comb += [
            self.m_axis_tdata.eq(handed.data),
            self.m_axis_tuser.eq(handed.user),
            self.m_axis_tvalid.eq(valid),
            core.m_axis_tready.eq(ready),
        ]
        return m

    def _connect_calibration(
        self, m: Module, calibration: Core | FoldedCore, decimator: CicDecimator | ChannelDecimator
    ) -> None:
        """Let samples go through the calibration to the decimator."""
        m.d.comb += [
            calibration.aclk.eq(self.aclk),
            calibration.aresetn.eq(self.aresetn),
            calibration.s_axis_tdata.eq(self.s_axis_tdata),
            decimator.i_data.eq(calibration.m_axis_tdata),
            decimator.i_flags.eq(calibration.m_axis_tuser),
            decimator.i_valid.eq(calibration.m_axis_tvalid),
            calibration.m_axis_tready.eq(decimator.i_ready),
        ]
        if calibration.is_guarded:
            m.d.comb += decimator.i_fault.eq(calibration.m_axis_tuser[Flag.FAULT])
        if isinstance(decimator, ChannelDecimator):
            m.d.comb += calibration.s_axis_tdest.eq(self.s_axis_tdest)
            self._open(m, calibration.s_axis_tvalid, calibration.s_axis_tready)
        elif decimator.decimator.steady:
            self._fill(m, calibration, decimator)
        else:
            m.d.comb += [
                calibration.s_axis_tvalid.eq(self.s_axis_tvalid),
                self.s_axis_tready.eq(calibration.s_axis_tready),
            ]

    def _open(self, m: Module, valid: Value, ready: Value) -> None:
        """Let samples in to what takes them, but not before all memories behind it are cleared."""
        closed = Signal(range(self.opens + 1), init=self.opens)
        m.d.front += closed.eq(closed - closed.any())
        m.d.comb += [
            valid.eq(self.s_axis_tvalid & ~closed.any()),
            self.s_axis_tready.eq(ready & ~closed.any()),
        ]

    def _fill(self, m: Module, calibration: Core | FoldedCore, decimator: CicDecimator) -> None:
        """Let the first sample go through the calibration, and fill the decimator, before it is accepted."""
        first = Signal(init=1)
        fills = Signal()
        filled = Signal()
        flows = ~first & ~fills & ~filled
        m.d.comb += [
            calibration.s_axis_tvalid.eq(self.s_axis_tvalid & (first | flows)),
            self.s_axis_tready.eq(filled | (flows & calibration.s_axis_tready)),
        ]
        m.d.front += filled.eq(0)
        with m.If(first & self.s_axis_tvalid & calibration.s_axis_tready):
            m.d.front += [first.eq(0), fills.eq(1)]
        with m.If(fills & calibration.m_axis_tvalid & decimator.i_ready):
            m.d.front += [fills.eq(0), filled.eq(1)]
