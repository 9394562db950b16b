"""FIR filters of the same samples, which lie in a ring of memory: one multiplier takes their steps, filter by filter.

::

                                 +---------+  bits
    s_axis_tdata --> [sample] -->| ring    |---> [first] ---+
                 several channels| words   |                v
    [pointer] - offset - 1 ----->|         |                + or - ---> [pair] --> * --> [product] --> + --> [total]
                                 +---------+                ^        bits + 1      ^                   ^       |
                                 | ring    |---> [second] --+                      |                   |       |
                             +-->| again   |                                       |      half at first|-------+
                             |   +---------+                                       |                           |
    [step] --> [table] ------+-- offsets, sign, coefficient -----------------------+       limited, rounded <--+
                                                                                                 |
    m_axis_tdata, m_axis_tuser  <-- [code], [flags], as often as a result leaves  <--------------+

With samples x0, x1, .. for N = 2 and a filter of S steps, one channel, once the ring is filled::

    clock          0    1    2    ..   S+5   S+6   S+7   S+8
    accepted       x0                  (wait for the sum)   x1    x2
    step                0    1    ..   S+4
    m_axis_tvalid                            1

A step that the table has in one row reads its taps one clock later, adds them two later, multiplies three later, and is
in the sum four later; so offsets, sign and coefficient of a step stand in three rows of the table, one below the other.
With N = 1 every sample brings a result. Where several filters make as many results of a sample, their steps lie in the
table one filter after the other, and `turn` says which is in work.
The sum begins with half a step of the output, so that it is rounded by what is left out of it.

`pointer` is where the next sample goes. Before the first one the ring is filled, a word a clock: with zeros, or with
that sample as often as it has words. With one channel that sample waits on the stream until then.

With a fingerprint, the coefficients stand in a memory of their own, in two banks: a result is computed with those of
the bank that was active when the sample that brings it was taken.

With protection, ring, table and coefficients have check bits as asked for, which are compared where a step needs the
word; a wrong one in a ring is gone once a new sample has its place, so that nothing has to be cleared. `pointer`,
`phase`, `rail` and `counted` correct a wrong bit in any case: in `sosmith.hdl.shell.kept`, or in the control word of
their channel, which is filled anew when that has two.

With several channels a sample is kept, with its channel, while the control word of that is read: whether it has been
filled, `pointer`, `phase`, `rail` and `counted`. After a reset all control words are cleared, one a clock.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib import data
from amaranth.lib.memory import Memory

from sosmith.hdl.axi_stream import extended
from sosmith.hdl.check_bits import CheckBits, Read
from sosmith.hdl.memory_ports import read_port, write_port
from sosmith.hdl.pipelined_logic import limits
from sosmith.hdl.plan.rounded_sum import finest, last_node, rounding, sum_bits
from sosmith.hdl.plan.streams import channel_bits
from sosmith.hdl.plan.tap_steps import PIPELINE, StepsInTurn, tap_steps
from sosmith.hdl.reload import ReloadPort
from sosmith.hdl.shell.fault_guard import FaultGuard
from sosmith.hdl.shell.kept import Kept
from sosmith.hdl.shell.shell import Shell
from sosmith.hdl.status import NEVER, ResultStatus, at_rail, status_of_result, with_fault
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.downsampler import Downsampler
from sosmith.model.dataflow.graph import Op
from sosmith.model.reload.constants import with_room

_NO_COLLISIONS = {"no_rw_check": 1}
"""Attribute of memories: no word is used that is read at the clock at which it is written."""


_LATER = 2
"""Clocks from the addresses of a step's taps to its coefficient."""


class _Kept(NamedTuple):
    """What is kept of a channel from one sample to the next."""

    pointer: Value
    phase: Value
    rail: Value
    counted: Value


class _Taken(NamedTuple):
    """A sample that is taken at this clock, and what it changes."""

    taken: Signal
    completes: Value
    rail: Value
    counted: Value
    after: _Kept


class RingCore(Shell):
    """An FIR filter, which may decimate, or several of the same samples, for any number of channels in any order.

    Latency and throughput: those of `sosmith.hdl.plan.tap_steps.TapSteps`. With several channels a sample of a channel
    that does not exist is accepted and dropped.

    Parameters
    ----------
    datapath : Datapath
        What it computes: one FIR section that keeps samples, the output stage, and a downsampler.
    channels : int
        Number of channels.
    others : sequence of Datapath
        What it computes of each sample after that, one result after the other: filters alike but for their taps, with
        fixed coefficients.
    block : int or None
        Bits of an operand of a multiplier block that each product must fit, with fixed coefficients; None for whole
        products.
    copies : int
        Times that each result leaves.
    fingerprint : int or None
        Fingerprint of the structure, 32 bits; None for a core whose coefficients cannot be loaded.
    lock : bool
        Whether loading can be locked until a reset.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`, for all memories.

    Members
    -------
    aclk, aresetn, s_axis_*, m_axis_*, s_axil_*
        As those of `sosmith.hdl.shell.shell.Shell`.
    """

    def __init__(
        self,
        datapath: Datapath,
        channels: int = 1,
        *,
        others: Sequence[Datapath] = (),
        block: int | None = None,
        copies: int = 1,
        fingerprint: int | None = None,
        lock: bool = False,
        protect: str = "none",
    ) -> None:
        if datapath.downsampler is None:
            raise ValueError("datapath must have a downsampler")
        self._down: Downsampler = datapath.downsampler
        self._filters = (datapath, *others)
        steps = tuple(tap_steps(each, loadable=fingerprint is not None) for each in self._filters)
        self._steps = StepsInTurn(steps, datapath.inputs[0], block)
        self._copies = copies
        # Flags are those of a result that can be limited, if any can.
        limited = [each for each in self._filters if last_node(each).op is Op.CLAMP]
        super().__init__((*limited, datapath)[0], channels, fingerprint, lock=lock, protect=protect)

    def fill(self, m: Module) -> None:
        """Build control, rings and the multiplier."""
        (port,) = self.datapath.inputs
        self._idle, self._running = Signal(name="idle"), Signal(name="running")
        self._step = Signal(range(max(self._steps.last_steps) + 1), name="step", reset_less=True)
        self._turn = Signal(range(len(self._filters)), name="turn")
        self._kept = Kept(m, self._sizes(), guarded=self.is_guarded) if self.channels == 1 else None
        self._pointer = (
            Signal(range(self._steps.words), name="pointer") if self._kept is None else self._kept.values["pointer"]
        )
        self._found: list[Read] = [] if self._kept is None else [Read(NEVER, self._kept.corrected, self._kept.failed)]
        self._channel = Signal(channel_bits(self.channels), name="channel")
        ready = Signal(name="result_leaves")
        if self.channels == 1:
            (code,) = self.codes(self.s_axis_tdata)
            taken, write = self._one_channel(m, code)
        else:
            kept = Signal(signed(port.bits) if port.signed else port.bits, name="sample", reset_less=True)
            taken, write = self._several_channels(m, kept)
        rail, counted = self._of_result(m, taken)
        with m.If(taken.taken & taken.completes):
            m.d.sync += [self._running.eq(1), self._step.eq(0)]
        ends = Signal(name="ends")
        m.d.comb += ends.eq(self._running & (self._step == self._last_step))
        with m.If(self._running & ~ends):
            m.d.sync += self._step.eq(self._step + 1)
        with m.If(ends & ready):
            self._goes_on(m)
        reload = self._reload(m, taken.taken & taken.completes)
        total = self._multiply(m, write, reload)
        self._give(m, total, ends, ready, (rail, counted), None if reload is None else reload[0])

    @property
    def _last_step(self) -> Value:
        """Number of the clock at which the sum of the result in work is complete."""
        first, *others = self._steps.last_steps
        last: Value = Const(first)
        for turn, each in enumerate(others, start=1):
            last = last if each == first else Mux(self._turn == turn, each, last)
        return last

    def _goes_on(self, m: Module) -> None:
        """Begin the next result of the sample; behind the last one, wait for the next sample."""
        if len(self._filters) == 1:
            m.d.sync += self._running.eq(0)
            return
        last = self._turn == len(self._filters) - 1
        m.d.sync += [self._step.eq(0), self._turn.eq(Mux(last, 0, self._turn + 1))]
        with m.If(last):
            m.d.sync += self._running.eq(0)

    def _in_steps(self, first: int, last: int) -> Value:
        """Whether a word that has been read is needed: at the clocks from one step to another."""
        return self._running & (self._step >= first) & (self._step <= last) if self.is_guarded else NEVER

    def _checked(self, m: Module, check: CheckBits, word: Value, name: str, needed: Value) -> Value:
        """Return the data of a word that has been read, and note what is found wrong in it while it is `needed`."""
        read = check.read(m, word, name)
        if self.is_guarded:
            self._found.append(Read(NEVER, read.corrected & needed, read.failed & needed))
        return read.data

    # What is kept of a channel.

    @property
    def _settles(self) -> bool:
        return self.datapath.settles

    @property
    def _settling_samples(self) -> int:
        """Samples that are flagged after a start from zero; 0 without the flag."""
        graph = self.datapath.stages[-1].graph
        return next((graph.nodes[i].high for i in graph.delays), 0)

    def _sizes(self) -> dict[str, int]:
        return {
            "pointer": (self._steps.words - 1).bit_length(),
            "phase": (self._down.factor - 1).bit_length(),
            "rail": 1,
            "counted": self._settling_samples.bit_length(),
        }

    def _taken(self, m: Module, taken: Signal, kept: _Kept, code: Value) -> _Taken:
        """Return what a sample changes: the place of the next one, and whether it brings a result."""
        completes = Signal(name="completes")
        rail = Signal(name="rail_now")
        m.d.comb += [
            completes.eq(~kept.phase.any()),
            rail.eq(kept.rail | at_rail(self.datapath.inputs, code)),
        ]
        settling = kept.counted < self._settling_samples if self._settles else Const(0, 1)
        last = self._down.factor - 1
        after = _Kept(
            pointer=(kept.pointer + 1)[: len(kept.pointer)],
            phase=Mux(kept.phase == last, 0, kept.phase + 1)[: len(kept.phase)],
            rail=rail & ~completes,
            counted=(kept.counted + settling)[: len(kept.counted)],
        )
        return _Taken(taken, completes, rail, kept.counted, after)

    def _one_channel(self, m: Module, code: Value) -> tuple[_Taken, tuple[Value, Value, Value]]:
        """Take the samples of one channel; return also address and word of the ring, and when it is written."""
        filling, steady = Signal(init=1, name="filling"), self._down.filled > 0
        kept = self._kept
        assert kept is not None
        taken, fills = Signal(name="taken"), Signal(name="fills")
        m.d.comb += [
            self._idle.eq(~self._running & ~filling),
            self.s_axis_tready.eq(self._idle),
            taken.eq(self._idle & self.s_axis_tvalid),
            fills.eq(filling & self.s_axis_tvalid if steady else filling),
        ]
        sample = self._taken(m, taken, _Kept(**kept.values), self.s_axis_tdata)
        with m.If(fills):
            kept.load("pointer", sample.after.pointer)
            with m.If(self._pointer.all()):
                m.d.sync += filling.eq(0)
        with m.If(taken):
            for name in kept.values:
                kept.load(name, getattr(sample.after, name))
        word = code if steady else Mux(filling, 0, code)
        return sample, (self._pointer, word, taken | fills)

    def _several_channels(self, m: Module, sample: Signal) -> tuple[_Taken, tuple[Value, Value, Value]]:
        """Take the samples of all channels, each with its control word; return the same."""
        (code,) = self.codes(self.s_axis_tdata)
        steady = self._down.filled > 0
        clearing, waits = Signal(init=1, name="clearing"), Signal(name="waits")
        filling, fresh = Signal(name="filling"), Signal(name="fresh", reset_less=True)
        dest = self.s_axis_tdest
        layout = data.StructLayout({"started": 1, **self._sizes()})
        check = CheckBits(layout.size, "correct" if self.is_guarded else "none")
        m.submodules.control_memory = memory = Memory(
            shape=check.width, depth=self.channels, init=[], attrs=_NO_COLLISIONS
        )
        reader, writer = read_port(memory, "control"), write_port(memory, "control")
        read = check.read(m, reader.data, "control")
        word = data.View(layout, read.data)
        started = word.started & ~read.failed if self.is_guarded else word.started
        accepted, taken = Signal(name="accepted"), Signal(name="taken")
        m.d.comb += [
            self._idle.eq(~self._running & ~filling & ~clearing & ~waits),
            self.s_axis_tready.eq(self._idle),
            accepted.eq(self._idle & self.s_axis_tvalid & (dest < self.channels)),
            reader.addr.eq(dest),
            reader.en.eq(self._idle),
            taken.eq(waits & (fresh | started)),
        ]
        with m.If(accepted):
            m.d.sync += [waits.eq(1), fresh.eq(0), sample.eq(code), self._channel.eq(dest)]
        fields = {name: Signal(bits, name=f"{name}_before") for name, bits in self._sizes().items()}
        m.d.comb += [net.eq(Mux(fresh, 0, getattr(word, name))) for name, net in fields.items()]
        now = _Kept(**fields)
        change = self._taken(m, taken, now, sample)
        with m.If(waits):
            m.d.sync += [waits.eq(0), self._pointer.eq(change.after.pointer)]
            with m.If(~taken):
                m.d.sync += [filling.eq(1), self._pointer.eq(0)]
        with m.If(filling):
            m.d.sync += self._pointer.eq(self._pointer + 1)
            with m.If(self._pointer.all()):
                m.d.sync += [filling.eq(0), waits.eq(1), fresh.eq(1)]
        with m.If(clearing):
            m.d.sync += self._channel.eq(self._channel + 1)
            with m.If(self._channel == self.channels - 1):
                m.d.sync += clearing.eq(0)
        kept = Cat(Const(1, 1), *(getattr(change.after, name) for name in self._sizes()))
        m.d.comb += [
            writer.addr.eq(self._channel),
            writer.data.eq(Mux(clearing, 0, check.written(kept))),
            writer.en.eq(clearing | taken),
        ]
        if self.is_guarded:
            needed = waits & ~fresh
            self._found.append(Read(NEVER, needed & read.corrected, needed & read.failed))
        place = Mux(filling, self._pointer, now.pointer)
        value = sample if steady else Mux(filling, 0, sample)
        return change, (place, value, filling | taken)

    def _of_result(self, m: Module, sample: _Taken) -> tuple[Value, Value]:
        """Keep what a result has from the sample that brings it: whether a code was at a rail, and the count."""
        rail = Signal(name="result_rail", reset_less=True)
        counted = Signal(len(sample.counted), name="result_counted", reset_less=True)
        with m.If(sample.taken & sample.completes):
            m.d.sync += [rail.eq(sample.rail), counted.eq(sample.counted)]
        return rail, counted

    # The sum.

    def _reload(self, m: Module, begins: Value) -> tuple[ReloadPort, Signal] | None:
        """Return what loads coefficients, and the bank of those for the result in work, which `begins` at a clock."""
        if self.fingerprint is None:
            return None
        plan = self._steps
        port = ReloadPort(
            len(plan.rounds[0]),
            bits=plan.factor_bits,
            design=self.fingerprint,
            protected=self.is_guarded,
            lock=self.lock,
        )
        self.join_port(m, port)
        used = Signal(name="bank_in_use", reset_less=True)
        with m.If(begins):
            m.d.sync += used.eq(port.bank)
        m.d.comb += [port.may_swap.eq(1), port.shadow_free.eq(~self._running | (used == port.bank))]
        return port, used

    def _coefficients(self, m: Module, rows: list[int], reload: tuple[ReloadPort, Signal]) -> Value:
        """Make the memory of both banks of coefficients; return the one that was read."""
        port, used = reload
        size = self._steps.factor_bits
        check = CheckBits(size, self.protect)
        m.submodules.coefficients_memory = memory = Memory(
            shape=check.width if self.is_guarded else signed(size),
            depth=2 * len(rows),
            init=[check.word(row & (1 << size) - 1) for row in rows] if self.is_guarded else rows,
            attrs=_NO_COLLISIONS,
        )
        reader, writer = read_port(memory, "coefficients"), write_port(memory, "coefficients")
        bits = len(self._step)
        m.d.comb += [
            reader.addr.eq(Cat(self._step, used)),
            reader.en.eq(1),
            writer.addr.eq(Cat((port.write_address + _LATER)[:bits], ~port.bank)),
            writer.data.eq(check.written(port.write_data)),
            writer.en.eq(port.write_enable),
        ]
        needed = self._in_steps(_LATER + 1, _LATER + len(self._steps.rounds[0]))
        coefficient = self._checked(m, check, reader.data, "coefficients", needed)
        return coefficient.as_signed() if self.is_guarded else coefficient

    def _multiply(
        self, m: Module, write: tuple[Value, Value, Value], reload: tuple[ReloadPort, Signal] | None
    ) -> Signal:
        """Build the table of steps, the rings, and the multiplier; return the sum."""
        plan = self._steps
        pairs = plan.pairs
        alone = pairs and any(step.second is None for steps in plan.rounds for step in steps)
        differs = any(step.sign < 0 for steps in plan.rounds for step in steps)
        bits = (plan.words - 1).bit_length()
        factor_bits = plan.factor_bits
        layout = data.StructLayout(
            {
                "first": bits,
                "second": bits if pairs else 0,
                "alone": int(alone),
                "minus": int(differs),
                "part": (plan.parts - 1).bit_length(),
                "shift": plan.shifts.bit_length(),
                **({"coefficient": signed(factor_bits)} if reload is None else {}),
            }
        )
        size, most = 1 << len(self._step), max(map(len, plan.rounds))
        rows = [0] * (size * len(plan.rounds))
        at = {name: field.offset for name, field in layout}
        for k, step in ((size * turn + k, step) for turn, own in enumerate(plan.rounds) for k, step in enumerate(own)):
            second = step.first if step.second is None else step.second
            rows[k] |= step.first << at["first"] | (second << at["second"] if pairs else 0)
            rows[k + 1] |= (step.second is None) * alone << at["alone"] | (step.sign < 0) << at["minus"]
            rows[k + 1] |= step.part << at["part"]
            rows[k + _LATER + 1] |= step.shift << at["shift"]
            if reload is None:
                rows[k + _LATER] |= (step.coefficient & ((1 << factor_bits) - 1)) << at["coefficient"]
        check = CheckBits(layout.size, self.protect)
        words = [check.word(code) for code in rows]
        m.submodules.steps_memory = table = Memory(shape=check.width, depth=len(rows), init=words)
        reader = read_port(table, "steps")
        m.d.comb += [reader.addr.eq(Cat(self._step, self._turn)), reader.en.eq(1)]
        needed = self._in_steps(1, _LATER + most + (plan.shifts > 0))
        row = data.View(layout, self._checked(m, check, reader.data, "steps", needed))
        if reload is None:
            coefficient: Value = row.coefficient
        else:
            own = [0] * _LATER + [step.coefficient for step in plan.rounds[0]]
            coefficient = self._coefficients(m, own + [0] * (len(rows) - len(own)), reload)
        needed = self._in_steps(_LATER, _LATER + most - 1)
        second_needed = needed & ~row.alone if alone and self.is_guarded else needed
        taps = [
            self._ring(m, name, getattr(row, name), write, needs)
            for name, needs in (("first", needed), ("second", second_needed))[: 1 + pairs]
        ]
        pair = Signal(signed(plan.data_bits), name="pair", reset_less=True)
        first, second = taps[0], taps[-1]
        other: Value = Mux(row.alone, 0, second) if alone else second
        both: Value = first if not pairs else Mux(row.minus, first - other, first + other) if differs else first + other
        product = Signal(signed(len(pair) + factor_bits), name="product", reset_less=True)
        # On the grid of the sum, which may be finer by what an offset of the output needs.
        m.d.sync += [pair.eq(self._part(m, both, row.part)), product.eq(pair * coefficient)]
        grid, begin = rounding(self._filters)
        filters = self._filters if reload is None else [with_room(each) for each in self._filters]
        total = Signal(signed(sum_bits(filters, grid)), name="total", reset_less=True)
        shift = grid - finest(self._filters)
        base = Mux(self._step == PIPELINE, Const(begin, signed(len(total))), total)
        shifted: Value = product << shift
        for places in range(1, plan.shifts + 1):
            shifted = Mux(row.shift == places, product << (shift + places * plan.digit_bits), shifted)
        m.d.sync += total.eq(base + shifted)
        return total

    def _part(self, m: Module, both: Value, part: Value) -> Value:
        """Return a digit of a sum of two samples, or all of it if it has one."""
        plan = self._steps
        if plan.parts == 1:
            return both
        whole = Signal(signed(plan.pair_bits), name="pair_of_samples")
        m.d.comb += whole.eq(both)
        low = plan.digit_bits * (plan.parts - 1)
        digit: Value = whole[low:].as_signed()
        for place in range(plan.parts - 1):
            start = plan.digit_bits * place
            digit = Mux(part == place, whole[start : start + plan.digit_bits], digit)
        return digit

    def _ring(self, m: Module, name: str, offset: Value, write: tuple[Value, Value, Value], needed: Value) -> Value:
        """Make a memory of the samples of all channels; return what a tap of the sample before the pointer is."""
        (port,) = self.datapath.inputs
        words = self._steps.words
        check = CheckBits(port.bits, self.protect)
        m.submodules[f"ring_{name}_memory"] = memory = Memory(
            shape=signed(port.bits) if port.signed and not self.is_guarded else check.width,
            depth=words * self.channels,
            init=[],
            attrs=_NO_COLLISIONS,
        )
        reader, writer = read_port(memory, f"ring_{name}"), write_port(memory, f"ring_{name}")
        place = Signal(range(words), name=f"place_{name}")
        m.d.comb += [
            place.eq(self._pointer + ~offset),  # - 1 - offset
            reader.addr.eq(Cat(place, self._channel)),
            reader.en.eq(1),
            writer.addr.eq(Cat(write[0], self._channel)),
            writer.data.eq(check.written(write[1][: port.bits]) if self.is_guarded else write[1]),
            writer.en.eq(write[2]),
        ]
        sample = self._checked(m, check, reader.data, f"ring_{name}", needed)
        return sample.as_signed() if port.signed and self.is_guarded else sample

    def _give(
        self,
        m: Module,
        total: Signal,
        ends: Value,
        ready: Signal,
        known: tuple[Value, Value],
        port: ReloadPort | None,
    ) -> None:
        """Round and limit the sum, and hand it on with its flags, as often as it leaves.

        Of its last sample, it is `known` whether a code since the last result was at a rail, and the count.
        """
        output, (rail, counted) = self.datapath.output, known
        last = last_node(self.datapath)
        grid, _ = rounding(self._filters)
        value: Value = total[grid:].as_signed() if grid > 0 else (total << -grid)
        code: Value = value
        saturated = Signal(name="output_saturated")
        if last.op is Op.CLAMP:
            below, above = Signal(name="below"), Signal(name="above")
            m.d.comb += [net.eq(outside) for net, outside in zip((below, above), limits(last, value), strict=True)]
            m.d.comb += saturated.eq(below | above)
            code = Mux(below, Const(last.low), Mux(above, Const(last.high), value))
        limited = Signal(signed(output.bits) if output.signed else output.bits, name="limited")
        m.d.comb += limited.eq(code)
        settling = counted < self._settling_samples if self._settles else Const(0, 0)
        status = status_of_result(
            m,
            self.datapath,
            limited,
            inputs=Cat(rail, Const(0, 1)),
            saturated=saturated,
            settling=settling,
            channel=self._channel,
            enable=Const(1),
            protect=self.protect,
        )
        given = status.flags
        if self.is_guarded:
            given = with_fault(given, self._fault(m, ends & ready, status, port))
        held = Signal(len(limited), name="code", reset_less=True)
        live = self.live_flags
        flags = Signal(len(live), name="flags", reset_less=True)
        dest = Signal(channel_bits(self.channels), name="dest", reset_less=True)
        leaves = Signal(name="leaves")
        m.d.comb += [ready.eq(~self.m_axis_tvalid | leaves)]
        passes = self.m_axis_tvalid & self.m_axis_tready
        if self._copies > 1:
            copies = Signal(range(self._copies), name="copies", reset_less=True)
            m.d.comb += leaves.eq(passes & ~copies.any())
            with m.If(passes):
                m.d.sync += copies.eq(copies - 1)
            with m.If(ends & ready):
                m.d.sync += copies.eq(self._copies - 1)
        else:
            m.d.comb += leaves.eq(passes)
        with m.If(leaves):
            m.d.sync += self.m_axis_tvalid.eq(0)
        with m.If(ends & ready):
            m.d.sync += [
                self.m_axis_tvalid.eq(1),
                held.eq(limited),
                flags.eq(Cat(given[bit] for bit in live)),
                dest.eq(self._channel),
            ]
        whole = held.as_signed() if output.signed else held
        m.d.comb += [
            self.m_axis_tdata.eq(extended(whole, len(self.m_axis_tdata))),
            self.m_axis_tuser.eq(with_fault(flags[:-1], flags[-1]) if self.is_guarded else flags),
        ]
        if self.channels > 1:
            m.d.comb += self.m_axis_tdest.eq(dest)

    def _fault(self, m: Module, gives: Value, status: ResultStatus, port: ReloadPort | None) -> Value:
        """Keep in mind that a wrong bit was found that could not be corrected; return whether one was, or is now.

        The guard is never idle: nothing is scrubbed, and nothing restarts.
        """
        guard = m.submodules.guard = FaultGuard(1)
        found = [*self._found, Read(NEVER, gives & status.corrected, gives & status.failed)]
        corrected, failed = Cat(each.corrected for each in found).any(), Cat(each.failed for each in found).any()
        self.report(m, guard, port, (corrected, failed), NEVER)
        return guard.fault | status.failed
