"""The folded and serial architectures: one multiply-accumulate unit that runs a datapath's program.

The unit is a pipeline that holds an instruction in each of its stages. Folded, with words of w = digit_bits + 1 bits::

    stage 1           2                 3                4                   5

    +---------+         address +-------+  w
    | program |->[ ]--+-------->| words |--+--> [data] ------------+
    | memory  |       |         |       |  |                       v   2w
    +---------+       |         |       |  |                       * -----> [product] --> + ---> added --+--> [total]
      ^               |    +--->|       |  |                       ^                      ^              |       |
      |               |    |    +-------+  +--> [operand] -+-> [factor]                   +--------------|-------+
    counter           |    |               |      PRODUCT  |       w                    accumulator_bits |
                      +----|---------------|--- constant --+ else                                        |
                      |    |               |       w                                                     |
                      +--- [moved] <-------+ MOVE; TAKE: digit of s_axis_tdata                           |
                           |                                                                             |
                           +--- low digit (STORE), signed low digit (FINISH), w <------------------------+
                                [given0], .. (GIVE) ---> m_axis_tdata <----------------------------------+

With two products a clock, an instruction also has a second address and a second constant. The words have a second
read port, and the sum of both products a pipeline stage of its own. A word to be moved waits for that, so that all
writes are in the last stage, and an instruction follows the one that writes its word one clock later than otherwise::

    stage 3          4                              5                    6

    words -+-> [data]        * [factor]         --> [product] --------+
           |                                                          + --> [products] --> + ---> added
           +-> [second_data] * [second_factor]  --> [second_product] -+                    ^
           |                      ^                                                      total
           |                 second constant
           +-> [passed4] ---------------------> [passed5] ----------------> [moved] ---> words

An instruction in pipeline stage 1 has been read from the program memory, in 2 it addresses the words, in 3 its word has
been read, in 4 it is multiplied, and in 5 it is added up. What is added is stored, given or dropped at once, and
`total` is what is left: shifted by a digit, or 0. A word is written three stages after it is read, with MOVE and TAKE
two, so that an instruction must follow the one that writes its word by `STORED` or `MOVED` of
`sosmith.model.dataflow.program`. That holds from one sample to the next as well: with one channel, and neither reload
nor protection, the program of the next sample is read at once behind that of the one before, whose last instructions
are then still in the pipeline::

    clock              0   1   2   ..  n-1   n   n+1  ..  n+4  n+5
    pipeline stage 1       0   1   ..  n-2  n-1   0   ..   3    4      instruction, the same n for every sample
    pipeline stage 5                                      n-1   0
    m_axis_tvalid                                               1      next sample: n clocks later

If the sink is not ready by then, the next sample goes on up to its own result, and waits there.

Serial has three pipeline stages and no multiplier block: the word is addressed in stage 1, in stage 2 it has been read
and is moved, and in stage 3 shifts and additions multiply in the accumulator itself, one clock for each bit of the
second factor, while the pipeline waits.

With protection, `sosmith.hdl.check_bits` stands behind both memories, and a scrubber reads them while no sample is in
work, one address a clock, at least one before each sample. What it corrects is written back::

    +--------+ word + check bits
    | memory |-----------------> check bits ---> instruction, word
    +--------+                     |    |
      ^   ^ scrub                  |    +------> corrected ---> written back, one clock later
      |   +-- [scrub] + 1          +-----------> failed ------> [broken] ---> all words are cleared after the result
      |                                               +-------> [fault] ----> m_axis_tuser, until a reset
      +-- counter, address of the instruction

As an example, the program in `sosmith.model.dataflow.folding.fold`, which computes ``y = floor(3 / 4 y1 + 4 x)`` with
digits of 4 bits, for x = 7 and y1 = 28 = 12 + 16 * 1. The sample is found at edge 0; at the edges 5 to 9, pipeline
stage 5 holds the instructions 0 to 4::

    edge                    5       6       7       8       9
    instruction          take    drop  multiply  store  finish
    product                 0   12*12    1*12     7*4       0
    total before the edge   0       0       9      21       3

The digits 49 mod 16 = 1 and 3 are stored: y = 1 + 16 * 3 = 49. The program has 9 instructions, so that `m_axis_tvalid`
is high at edge 9 + 5 = 14.
"""

from __future__ import annotations

from itertools import pairwise

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib.memory import Memory

from sosmith.hdl.axi_stream import extended
from sosmith.hdl.check_bits import CheckBits
from sosmith.hdl.cores.folded_state import NO_COLLISIONS, Control, Position, Reload, fault_nets
from sosmith.hdl.cores.multiply_accumulate import MultiplyAccumulate
from sosmith.hdl.cores.program_memory import ProgramMemory
from sosmith.hdl.instruction import PipelinedInstruction
from sosmith.hdl.memory_ports import read_port, write_port
from sosmith.hdl.pipelined_logic import limits
from sosmith.hdl.plan.folded_clocks import memory_depth, overlaps, word_slices
from sosmith.hdl.plan.instructions import address_bits, instruction_bits
from sosmith.hdl.plan.streams import channel_bits
from sosmith.hdl.reload import ReloadPort
from sosmith.hdl.shell.bank_pins import BankPins
from sosmith.hdl.shell.fault_guard import FaultGuard
from sosmith.hdl.shell.shell import Shell
from sosmith.hdl.status import OF_INPUT, at_rail, status_of_result, with_fault
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Op
from sosmith.model.dataflow.program import (
    EARLY_WRITES,
    FINISHES,
    LATE_WRITES,
    Judged,
    Location,
    Opcode,
    Program,
)

FUNCTIONS = ("sequencer", "program_memory", "word_memory", "multiply_accumulate", "result")
"""Modules of a core, in the order in which an instruction meets them."""

_WORDS_READ = ("read", "second_read")
"""The words that an instruction reads."""


class FoldedCore(Shell):
    """A datapath on one multiply-accumulate unit, for any number of channels in any order.

    Latency: `latency_cycles`. Throughput: one sample, of any channel, every `cycles_per_sample` clocks. After a reset
    the core first clears its memory, one word a clock. It accepts a sample once the program has read it:
    `s_axis_tready` waits for `s_axis_tvalid`, which AXI4-Stream allows. A sample of a channel that does not exist is
    accepted and dropped.

    With protection, a wrong bit in a memory that is not corrected raises the flag `fault` with the first sample that it
    could change, and with all later ones until a reset. After that sample the core clears its memory as after a reset,
    and goes on. A sample is accepted when its result is there, so that a damaged program neither loses nor doubles one.

    With a fingerprint, the core has two banks for its program, so that another one can be loaded while it works. Each
    sample is computed by the bank that was active when the core found it. If the datapath `restarts`, a swap waits
    for the result of the sample in work to leave, and the core then clears its memory as after a reset.

    Parameters
    ----------
    datapath : Datapath
        What it computes.
    program : Program
        The program that computes it.
    serial : bool
        Whether to multiply by shifts and additions instead of a hardware multiplier.
    channels : int
        Number of channels.
    fingerprint : int or None
        Fingerprint of the structure, 32 bits; None for a core whose program cannot be loaded.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`, for all memories.
    lock : bool
        Whether loading can be locked until a reset.
    flags_given : int
        How many flags of the inputs come with a sample, from a decimator, and are not read off its codes.
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
        program: Program,
        *,
        serial: bool,
        channels: int = 1,
        fingerprint: int | None = None,
        protect: str = "none",
        lock: bool = False,
        flags_given: int = 0,
        before_decimator: bool = False,
        pins: tuple[int, int] | None = None,
    ) -> None:
        self.program = program
        self.serial = serial
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
        """Build control, pipeline and memories, each a module of its own."""
        functions = {name: Module() for name in FUNCTIONS}
        for name, function in functions.items():
            m.submodules[name] = function
        control = Control(channel_bits(self.channels))
        guard = self._guard(m, control)
        reload = self._reload(m, functions["sequencer"], control)
        position = self._sequence(functions["sequencer"], control, guard, reload)
        memory = ProgramMemory(self.program, self.serial, self.protect)
        pipeline, fetched = memory.fetch(functions["program_memory"], control, position, reload, guard)
        read = [Signal(signed(self._word), name=name) for name in _WORDS_READ[: self.program.products]]
        added = Signal(signed(self.program.accumulator_bits))
        unit = MultiplyAccumulate(self.program, self.serial, self.fingerprint is not None)
        stages = self._reading(pipeline), pipeline[-1]
        unit.fill(functions["multiply_accumulate"], control.advance, stages, (read, added))
        remembered = self._remember(functions["word_memory"], control, (added, read), pipeline, guard)
        ends = self._ends(functions["program_memory"], control.advance, pipeline)
        begins = self._accepts(functions["sequencer"], control, pipeline, None if guard is None else ends)
        limits = self._give(functions["result"], control, (begins, ends), added, pipeline, guard)
        if guard is not None:
            memories = (fetched, remembered, limits)
            corrected, failed = (Cat(nets).any() for nets in zip(*memories, strict=True))
            found = corrected, failed | (control.start & self.given_fault) if self.flags_given else failed
            self.report(m, guard, None if reload is None else reload.port, found, control.start)

    def _sequence(self, m: Module, control: Control, guard: FaultGuard | None, reload: Reload | None) -> Position:
        """Find samples, and count through the program for each."""
        clearing, busy = control.clearing, control.busy
        m.d.comb += control.leaves.eq(self.m_axis_tvalid & self.m_axis_tready)
        if self._overlaps:
            waits = busy | clearing
        else:
            waits = (busy & ~control.leaves) | clearing if guard is None else busy | clearing | guard.broken
        swaps = reload.port if reload is not None and self.restarts and isinstance(reload.port, ReloadPort) else None
        if swaps is not None:
            waits = waits | swaps.pending
        self._accept(m, control, waits)
        position = self._count(m, control, early=guard is None)
        if guard is not None:
            self._restart(m, control, guard.restart)
        if swaps is not None:
            self._restart(m, control, swaps.pending & swaps.may_swap)
        return position

    def _ends(self, m: Module, advance: Signal, pipeline: list[PipelinedInstruction]) -> Signal:
        """Return whether the last instruction of a sample is in the last pipeline stage."""
        ends = Signal()
        last = self._gives_last(pipeline) if self._overlaps else ~pipeline[-2].valid
        m.d.comb += ends.eq(advance & pipeline[-1].valid & last)
        return ends

    def _accepts(
        self, m: Module, control: Control, pipeline: list[PipelinedInstruction], ends: Signal | None
    ) -> Signal:
        """Accept a sample, as it `ends` or once it has been read; return when its flags are to be taken."""
        taken = Signal()
        if ends is None:
            read = pipeline[-2 if self.serial else -3]  # not before the flags of the sample before have been copied
            last_digit = read.is_for(sum(location.digits for location in self.program.inputs) - 1)
            m.d.sync += taken.eq(control.advance & read.valid & read.has(Opcode.TAKE) & last_digit)
        else:
            m.d.sync += taken.eq(ends)
        m.d.comb += self.s_axis_tready.eq(taken | control.dropped)
        return taken if self._overlaps else control.start

    def _guard(self, m: Module, control: Control) -> FaultGuard | None:
        """Return the guard of the memories; None without protection."""
        if not self.is_guarded:
            return None
        depth = max(len(self.program.instructions), memory_depth(self.program, self.channels))
        m.submodules.guard = guard = FaultGuard((depth - 1).bit_length())
        m.d.comb += guard.idle.eq(~control.busy & ~control.clearing)
        return guard

    @staticmethod
    def _restart(m: Module, control: Control, cause: Value) -> None:
        """Clear what a damaged program or word, or another program, may have left: the words, as after a reset."""
        with m.If(cause):
            m.d.sync += [control.clearing.eq(1), control.channel.eq(0)]

    @property
    def _overlaps(self) -> bool:
        """Whether a sample is begun while the one before is in the pipeline."""
        reload = self.fingerprint is not None
        return overlaps(self.program, serial=self.serial, channels=self.channels, reload=reload, protect=self.protect)

    @property
    def _moves_early(self) -> bool:
        """Whether a word is moved at the clock at which the instruction before would store one."""
        return self.serial or self.program.products == 1

    @property
    def _word(self) -> int:
        """Width of a word."""
        return self.program.digit_bits + 1

    def _accept(self, m: Module, control: Control, waits: Value) -> None:
        """Start on a sample if its channel exists, otherwise drop it."""
        if self.channels == 1:
            m.d.comb += control.start.eq(self.s_axis_tvalid & ~waits)
            return
        offered, exists = Signal(name="found"), Signal(name="channel_exists")
        m.d.comb += [offered.eq(self.s_axis_tvalid & ~waits), exists.eq(self.s_axis_tdest < self.channels)]
        m.d.comb += [control.start.eq(offered & exists), self.m_axis_tdest.eq(control.channel)]
        m.d.sync += control.dropped.eq(offered & ~exists & ~control.dropped)
        with m.If(control.start):
            m.d.sync += control.channel.eq(self.s_axis_tdest)

    def _count(self, m: Module, control: Control, *, early: bool) -> Position:
        """Count through all words after a reset, to clear them, and through the program for each sample.

        If an instruction is to be read `early`, the first one is at the clock that finds the sample.

        While words are cleared, their channel and their address in the last pipeline stage follow the counter a clock
        late.

        Where samples overlap, the core is busy only while it reads the program, and waits before it computes a result
        as long as the one before has not left. The accumulator is then empty.
        """
        count, bits = len(self.program.instructions), address_bits(self.program)
        counter = Signal(max((count - 1).bit_length(), bits + max(1, len(control.channel))))
        fetching = Signal()
        fetches = Signal()
        m.d.comb += fetches.eq(fetching | control.start if early else fetching)
        is_last_instruction = Signal()
        m.d.comb += is_last_instruction.eq(counter == count - 1)
        leaves: Value = control.leaves
        if self._overlaps:
            waits = Signal(name="waits_for_sink")
            m.d.comb += waits.eq((counter == self.program.result_start) & self.m_axis_tvalid & ~self.m_axis_tready)
            m.d.comb += fetches.eq(control.start | (fetching & ~waits))
            leaves = fetches & is_last_instruction
        is_last = control.channel == self.channels - 1
        with m.If(control.clearing):
            m.d.sync += [counter.eq(counter + 1), control.channel.eq(counter[bits:])]
            with m.If(counter[bits] if self.channels == 1 else is_last & ~counter[:bits].any()):
                m.d.sync += [control.clearing.eq(0), counter.eq(0)]
        with m.Elif(fetches & control.advance):
            m.d.sync += [counter.eq(counter + 1), fetching.eq(1)]
            with m.If(is_last_instruction):
                m.d.sync += [fetching.eq(0), counter.eq(0)]
        with m.If(control.start):
            m.d.sync += [control.busy.eq(1), fetching.eq(1)]
        with m.Elif(leaves):
            m.d.sync += control.busy.eq(0)
        return Position(counter, fetches)

    def _reload(self, m: Module, sequencer: Module, control: Control) -> Reload | None:
        """Return the reload port, and the bank that the sample in work uses."""
        if self.fingerprint is None:
            return None
        depth, bits = len(self.program.instructions), instruction_bits(self.program)
        begun = Signal(name="sample_begun")
        port = (
            BankPins(*self.pins)
            if self.pins
            else ReloadPort(depth, bits=bits, design=self.fingerprint, protected=self.is_guarded, lock=self.lock)
        )
        self.join_port(m, port, control.start | begun)
        if self.pins:
            with sequencer.If(self.s_axis_tready):
                sequencer.d.sync += begun.eq(0)
            with sequencer.If(control.start):
                sequencer.d.sync += begun.eq(1)
        kept = Signal(reset_less=True)
        bank = Signal()
        with sequencer.If(control.start):
            sequencer.d.sync += kept.eq(port.bank)
        sequencer.d.comb += [
            bank.eq(Mux(control.start, port.bank, kept)),
            port.may_swap.eq(~control.busy & ~control.clearing if self.restarts else 1),
            port.shadow_free.eq(~control.busy | (kept == port.bank)),
        ]
        return Reload(port, bank)

    def _moved(self, m: Module, instruction: PipelinedInstruction, read: Value) -> Value:
        """Return the word that MOVE and TAKE write, and 0 for all others."""
        word = Mux(instruction.has(Opcode.TAKE), self._input_digit(instruction), read)
        word_to_move = Mux(instruction.valid & instruction.has(*EARLY_WRITES), word, 0)
        if self.serial:
            return word_to_move
        moved = Signal(self._word)  # 0 from a reset on, when words are cleared
        if self._moves_early:
            m.d.sync += moved.eq(word_to_move)
        else:
            passed = [word_to_move, *(Signal(self._word, name=f"passed{stage}") for stage in (4, 5)), moved]
            m.d.sync += [later.eq(earlier) for earlier, later in pairwise(passed)]
        return moved

    def _remember(
        self,
        m: Module,
        control: Control,
        values: tuple[Signal, list[Signal]],
        pipeline: list[PipelinedInstruction],
        guard: FaultGuard | None,
    ) -> tuple[Value, Value]:
        """Read the words at the instructions' addresses, and write those that they store or move.

        Return whether a wrong bit was corrected at this clock, and whether one was found that could not be.
        """
        (added, reads), advance, clearing = values, control.advance, control.clearing
        moved = self._moved(m, self._reading(pipeline), reads[0])
        addressing, last = pipeline[0 if self.serial else 1], pipeline[-1]
        present = pipeline[-2] if self._moves_early else last
        moves, stores, finishes = (Signal(name=name) for name in ("moves", "stores", "finishes"))
        m.d.comb += [
            moves.eq(present.valid & present.has(*EARLY_WRITES)),
            stores.eq(last.valid & last.has(*LATE_WRITES)),
            finishes.eq(last.valid & last.has(*FINISHES)),
        ]
        chosen = [addressing.address, addressing.second_address] if len(reads) > 1 else [addressing.address]
        addresses: list[Value] = [Cat(each, control.channel) for each in chosen]
        target = Mux(moves, present.target, last.target) if self._moves_early else last.target
        where: Value = Cat(target, control.channel)
        sign = self._word - 1
        # One LUT4 for each bit, since the sum is late: nothing is moved while something is stored.
        what = Cat(Mux(stores, added[:sign], moved[:sign]), Mux(finishes, added[sign], moved[sign]))
        what = what | (clearing & last.target.all())  # the word that always holds 1 is the last one of a channel
        enable = clearing | (advance & (moves | stores))
        check = CheckBits(self._word, self.protect)
        looks: Value = advance & self._reading(pipeline).valid
        if guard is not None:
            scrubs = guard.scrubs & self._is_word(guard.address)
            addresses = [Mux(scrubs, guard.address[: len(each)], each) for each in addresses]
            looks = looks | guard.read
        words = reads if guard is None else [Signal(check.width, name=f"{read.name}_word") for read in reads]
        words_read = [check.read(m, word, read.name) for word, read in zip(words, reads, strict=True)]
        # Each word that is read may come from a memory of its own, all of which are written alike.
        corrected, failed = (
            Cat(each.corrected for each in words_read).any(),
            Cat(each.failed for each in words_read).any(),
        )
        if guard is not None and self.protect == "correct":
            address = addresses[0]
            scrubbed = Signal(len(address), reset_less=True)
            rewrites = guard.read & corrected & ~clearing & (scrubbed != address)
            m.d.sync += scrubbed.eq(address)
            where = Mux(rewrites, scrubbed, where)
            what = Mux(rewrites, words_read[0].data, what)
            enable = enable | rewrites
        contents = self._memory(m, check, read=(addresses, advance), write=(where, check.written(what), enable))
        m.d.comb += [word.eq(content) for word, content in zip(words, contents, strict=True)]
        if guard is not None:
            m.d.comb += [read.eq(word.data) for read, word in zip(reads, words_read, strict=True)]
        return fault_nets(m, "words", looks & corrected, looks & failed)

    def _is_word(self, address: Value) -> Value:
        """Whether there is a word at an address to scrub."""
        return address < memory_depth(self.program, self.channels)

    def _reading(self, pipeline: list[PipelinedInstruction]) -> PipelinedInstruction:
        """Return the instruction whose word has just been read."""
        return pipeline[1 if self.serial else 2]

    def _memory(
        self, m: Module, check: CheckBits, read: tuple[list[Value], Value], write: tuple[Value, Value, Value]
    ) -> list[Value]:
        """Make the memory of all channels, cut into `word_slices`; return the words read."""
        words, depth = self.program.words, memory_depth(self.program, self.channels)
        slices: list[list[Value]] = [[] for _ in read[0]]
        for low, high in word_slices(depth, check.width):
            one = check.word(1) >> low & ((1 << (high - low)) - 1)
            init = [one if address % words == self.program.one else 0 for address in range(depth)]
            m.submodules[f"words{low}"] = ram = Memory(shape=high - low, depth=depth, init=init, attrs=NO_COLLISIONS)
            for name, address, parts in zip(_WORDS_READ, read[0], slices, strict=False):
                reader = read_port(ram, f"{name.removesuffix('read')}words{low}")
                m.d.comb += [reader.addr.eq(address), reader.en.eq(read[1])]
                parts.append(reader.data)
            writer = write_port(ram, f"words{low}")
            m.d.comb += [
                writer.addr.eq(write[0]),
                writer.data.eq(write[1][low:high]),
                writer.en.eq(write[2]),
            ]
        return [Cat(*parts) for parts in slices]

    def _give(
        self,
        m: Module,
        control: Control,
        sample: tuple[Value, Value],
        added: Signal,
        pipeline: list[PipelinedInstruction],
        guard: FaultGuard | None,
    ) -> tuple[Value, Value]:
        """Collect the parts of the result and its status; the last instruction gives the last part.

        Return whether a wrong bit in the limits of wear was corrected, and whether one was found that could not be.
        """
        (begins, ends), advance = sample, control.advance
        last, parts = pipeline[-1], self.program.output.parts
        widths = [self.program.digit_bits] * (parts - 1) + [self._last_part_bits]
        given = [Signal(width, name=f"given{k}", reset_less=True) for k, width in enumerate(widths)]
        for k, part in enumerate(given):
            with m.If(advance & last.valid & last.has(Opcode.GIVE) & (last.gives(k) if parts > 1 else Const(1))):
                m.d.sync += part.eq(added)
        with m.If(ends):
            m.d.sync += self.m_axis_tvalid.eq(1)
        with m.If(control.leaves):
            m.d.sync += self.m_axis_tvalid.eq(0)
        rail = Signal(reset_less=True)
        outside = Signal(reset_less=True)
        with m.If(begins):
            known = self.given_flags if self.flags_given else at_rail(self.datapath.inputs, self.s_axis_tdata)
            both = self.flags_given == OF_INPUT
            m.d.sync += [rail.eq(known[0] if both else known), outside.eq(known[1] if both else 0)]
        if self.fingerprint is not None or any(i.opcode is Opcode.JUDGE for i in self.program.instructions):
            judges = last.valid & last.has(Opcode.JUDGE) & added[-1]
            if self.datapath.settles:
                judges = judges & last.judges(Judged.OUTSIDE)
            with m.If(advance & judges):
                m.d.sync += outside.eq(1)
        judged: Value = Cat(rail, outside)
        settling = self._settling(m, advance, last, added)
        if self._overlaps:  # the next sample may have begun
            now = Cat(judged, settling)
            judged = Signal(len(now), name="judged", reset_less=True)
            with m.If(ends):
                m.d.sync += judged.eq(now)
            judged, settling = judged[:2], judged[2:]
        code, saturated = self._limited(m, given)
        # Without protection the limits are read again and again; with it just once, so that an upset changes no flag
        # of a result that waits for the sink.
        status = status_of_result(
            m,
            self.datapath,
            code,
            inputs=judged,
            saturated=saturated,
            settling=settling,
            channel=control.channel,
            enable=Const(1) if guard is None else ends,
            protect=self.protect,
        )
        flags = status.flags
        m.d.comb += [
            self.m_axis_tdata.eq(extended(code, len(self.m_axis_tdata))),
            self.m_axis_tuser.eq(flags if guard is None else with_fault(flags, guard.fault | status.failed)),
        ]
        return fault_nets(m, "limits", control.leaves & status.corrected, control.leaves & status.failed)

    def _settling(self, m: Module, advance: Signal, last: PipelinedInstruction, added: Signal) -> Value:
        """Return whether the program has judged that the sample comes before the filter has settled."""
        if not self.datapath.settles:
            return Const(0, 0)
        settling = Signal(reset_less=True)
        with m.If(advance & last.valid & last.has(Opcode.JUDGE) & last.judges(Judged.SETTLING)):
            m.d.sync += settling.eq(added[-1])
        return settling

    def _gives_last(self, pipeline: list[PipelinedInstruction]) -> Value:
        """Whether the last pipeline stage has the last part of a result."""
        parts = self.program.output.parts
        return pipeline[-1].has(Opcode.GIVE) & (pipeline[-1].gives(parts - 1) if parts > 1 else Const(1))

    def _input_digit(self, instruction: PipelinedInstruction) -> Value:
        """Return the digit of the input sample that a TAKE asks for; digits are numbered through all ports."""
        graph = self.datapath.stages[0].graph
        digits: list[Value] = []
        codes = self.codes(self.s_axis_tdata)
        for code, node, location in zip(codes, graph.inputs, self.program.inputs, strict=True):
            padded = Cat(Const(0, location.frac - graph.nodes[node].frac), code)
            digits += self._split(padded, location, sign=padded[-1] if code.shape().signed else Const(0, 1))
        selected = digits[-1]
        for k, digit in enumerate(digits[:-1]):
            selected = Mux(instruction.is_for(k), digit, selected)
        return selected

    def _split(self, value: Value, location: Location, sign: Value) -> list[Value]:
        """Return the digits of a value, the lowest first, each as wide as a word."""
        bits = self.program.digit_bits
        whole = Cat(value, *([sign] * max(0, bits * location.digits + 1 - len(value))))
        low = [Cat(whole[bits * k : bits * (k + 1)], Const(0, 1)) for k in range(location.digits - 1)]
        return [*low, whole[bits * (location.digits - 1) : bits * location.digits + 1]]

    @property
    def _result_bits(self) -> int:
        """Width of the result before it is limited, as far as it counts."""
        graph, output = self.datapath.stages[-1].graph, self.datapath.output
        last = graph.nodes[graph.outputs[0]]
        if last.op is not Op.CLAMP:
            return output.bits + (not output.signed)
        node = graph.nodes[last.operands[0]]
        if self.fingerprint is None:
            return node.width + (not node.signed)
        # A program loaded later may have other ranges.
        return self.program.digit_bits * (self.program.output.parts - 1) + self.program.accumulator_bits

    @property
    def _last_part_bits(self) -> int:
        """Width of the last part of the result: all of the accumulator that counts."""
        rest = self._result_bits - self.program.digit_bits * (self.program.output.parts - 1)
        return max(1, min(rest, self.program.accumulator_bits))

    def _limited(self, m: Module, given: list[Signal]) -> tuple[Value, Value]:
        """Return the output code from its parts, limited to the port's range, and whether it had to be limited."""
        output = self.datapath.output
        value = Cat(*given)[: self._result_bits].as_signed()
        graph = self.datapath.stages[-1].graph
        last = graph.nodes[graph.outputs[0]]
        code: Value = value
        saturated = Signal(name="output_saturated")
        if last.op is Op.CLAMP:
            below, above = Signal(name="below"), Signal(name="above")
            m.d.comb += [net.eq(outside) for net, outside in zip((below, above), limits(last, value), strict=True)]
            m.d.comb += saturated.eq(below | above)
            code = Mux(below, Const(last.low), Mux(above, Const(last.high), value))
        limited = Signal(signed(output.bits) if output.signed else output.bits)
        m.d.comb += limited.eq(code)
        return limited, saturated
