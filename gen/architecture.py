"""Hardware architectures of a datapath: all operations in parallel, one unit shared by all, or digit by digit."""

from __future__ import annotations

import decimal
import zlib
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from sosmith.gen.fpga.boards import Board
from sosmith.gen.word_lengths.cost import MULTIPLIER_BITS, Cost, cost_of_graphs, products_from_adders, scalings
from sosmith.gen.word_lengths.objective import FEW_ADDERS, SMALL_AREA, Objective, ShortProgram, unsuitable
from sosmith.gen.word_lengths.online_units import OnlineUnits, online_cost, unsuitable_online
from sosmith.hdl.plan import decimator_clocks, folded_clocks, online_clocks, parallel_clocks
from sosmith.hdl.plan.instructions import instruction_bits
from sosmith.hdl.plan.unfolding import unfolded_stages
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.decimator import Decimator
from sosmith.model.dataflow.folding import FoldingError, program
from sosmith.model.dataflow.graph import Graph, Node, Op
from sosmith.model.dataflow.program import Program
from sosmith.model.errors import ShortfallError
from sosmith.model.reload.constants import with_room
from sosmith.model.reload.registers import BITS
from sosmith.model.sections.online import OnlineError, OnlineSchedule

if TYPE_CHECKING:
    from amaranth.lib.wiring import Component

    from sosmith.hdl.block_core import BlockCore
    from sosmith.hdl.core import Core
    from sosmith.hdl.folded import FoldedCore

DIGIT_BITS = 15
"""Width of a digit without a board: factors of 16 bits, a sign included, suit every multiplier block that is known."""

SPARE_ACCUMULATOR_BITS = 2
"""Additional bits, beyond the needs of its own program, in hardware that can load other programs."""

SPARE_WORDS = 4
"""Words of memory beyond the needs of its own program, in hardware that can load other programs."""

SPARE_INSTRUCTIONS = 4
"""A replaceable program has spare instructions: one for each group of this many."""


class Blocks(NamedTuple):
    """How many multiplier blocks there are, None for as many as it takes, and the bits of a signed operand."""

    available: int | None
    bits: int = MULTIPLIER_BITS


NO_LIMIT = Blocks(None)


@dataclass(frozen=True)
class Architecture:
    """A datapath and the architecture of its hardware.

    Attributes
    ----------
    name : str
        "parallel": every operation has its own hardware. "folded": one multiplier and one accumulator run a program.
        "serial": the same without a multiplier block. "online": sections work on signed digits, the most significant
        first.
    datapath : Datapath
        The datapath.
    channels : int
        Number of channels.
    reload : bool
        Whether constants can be loaded at run time.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`.
    digit_bits : int
        Width of a digit of the program, one bit less than a factor of the multiplier; less if an instruction must fit
        a register to be loadable.
    blocks : Blocks
        Multiplier blocks that there are for the products of the parallel architecture.
    samples_per_clock : int
        Samples in a beat of the streams; more than one in the parallel architecture only.
    look_ahead : bool
        Whether the loops of the parallel architecture, which go back several samples, are pipelined through those
        between. All products by constants are then made of adders.
    hold : bool
        Whether each result behind a decimator is handed out once for each of its samples.
    ahead : Architecture or None
        That of the calibration before a decimator; None without one.
    """

    name: str
    datapath: Datapath
    channels: int = 1
    reload: bool = False
    protect: str = "none"
    digit_bits: int = DIGIT_BITS
    blocks: Blocks = NO_LIMIT
    samples_per_clock: int = 1
    look_ahead: bool = False
    hold: bool = False
    ahead: Architecture | None = None

    @property
    def _is_block(self) -> bool:
        """Whether the hardware is a `sosmith.hdl.block_core.BlockCore`."""
        return self.look_ahead or self.samples_per_clock > 1

    @cached_property
    def _graphs(self) -> list[Graph]:
        """What the stages of the parallel hardware compute at a clock."""
        return [stage.graph for stage in unfolded_stages(self.datapath, self.samples_per_clock)]

    @cached_property
    def adders(self) -> tuple[frozenset[int], ...]:
        """Products by constants that are made of adders, by stage: for which there are no multiplier blocks left.

        With several samples a clock, those of the unfolded stages. None of them if the constants can be loaded, and in
        the other architectures.
        """
        if self.look_ahead:
            return tuple(map(scalings, self._graphs))
        fixed = self.name == "parallel" and not self.reload
        return products_from_adders(self._graphs, self.blocks.available if fixed else None, self.blocks.bits)

    @property
    def copies_per_result(self) -> int:
        """Times that each result is handed out."""
        return self.decimator.factor if self.hold and self.decimator is not None else 1

    @property
    def decimator(self) -> Decimator | None:
        """What stands before the datapath's first stage; None if all samples go in."""
        return self.datapath.decimator

    @property
    def cost(self) -> Cost:
        """Operators of the online architecture, or else of the parallel one, before synthesis; no decimator's.

        Those of a calibration before a decimator are among them, unless that alone has a program.
        """
        if self.online is not None:
            return online_cost(self.datapath)
        own = cost_of_graphs(self._graphs, self.adders)
        apart = self.ahead is None or (self.program is None and self.ahead.program is not None)
        return own if self.ahead is None or apart else self.ahead.cost.beside(own)

    @property
    def multiplier_blocks(self) -> int:
        """Multiplier blocks that it takes, without what stands before a decimator."""
        if self.program is not None:
            return int(self.name == "folded")
        found = cost_of_graphs(self._graphs, self.adders).multiplications
        return sum(product.blocks_of(self.blocks.bits) for product in found)

    @property
    def memory_bits(self) -> int | None:
        """Bits of memory, with those of what stands before a decimator; None if nothing has any."""
        programs = [each.program for each in (self.ahead, self) if each is not None and each.program is not None]
        return sum(each.words * (each.digit_bits + 1) for each in programs) if programs else None

    @cached_property
    def online(self) -> OnlineSchedule | None:
        """Clocks of the units in the online architecture; None in the others.

        Raises
        ------
        ShortfallError
            If a section is not one for on-line arithmetic.
        """
        if self.name != "online":
            return None
        try:
            return online_clocks.schedule_of(self.datapath)
        except OnlineError as error:
            raise ShortfallError(unsuitable_online(error)) from None

    @cached_property
    def program(self) -> Program | None:
        """Program of the shared unit; None in the parallel and the online architecture.

        Raises
        ------
        ShortfallError
            If the datapath cannot be folded.
        """
        if self.name in {"parallel", "online"}:
            return None
        try:
            made = program(self.datapath.behind_decimator, self.digit_bits, spare_words=SPARE_WORDS * self.reload)
            for digit_bits in range(self.digit_bits - 1, 0, -1):
                if not self.reload or instruction_bits(made) <= BITS:  # one register holds an instruction
                    break
                made = program(self.datapath, digit_bits, spare_words=SPARE_WORDS)
        except FoldingError as error:
            raise ShortfallError(unsuitable(self.name, error)) from None
        if not self.reload:
            return made
        roomy = replace(made, accumulator_bits=made.accumulator_bits + SPARE_ACCUMULATOR_BITS)
        return roomy.padded(len(made.instructions) + len(made.instructions) // SPARE_INSTRUCTIONS)

    @cached_property
    def built(self) -> Datapath:
        """The datapath with the widths of the parallel hardware."""
        return with_room(self.datapath) if self.reload and self.program is None else self.datapath

    @cached_property
    def fingerprint(self) -> int | None:
        """CRC-32 of everything about the hardware except its constants: sets are loadable if this is equal.

        None if the hardware is not reloadable.
        """
        if not self.reload:
            return None
        stages = [(stage.name, [structure(node) for node in stage.graph.nodes]) for stage in self.datapath.stages]
        made = self.program
        shape = (self.name, self.channels, self.datapath.inputs, self.datapath.output, stages)
        sizes = "None"
        if made is not None:
            count = len(made.instructions)
            sizes = f"({made.digit_bits}, {made.locations}, {made.words}, {made.accumulator_bits}, {count})"
        # A core without them keeps the number that it had before there were protection and restarts.
        guarded = "" if self.protect == "none" else f", {self.protect!r}"
        restarts = ", 'restarts'" if self.restarts else ""
        return zlib.crc32(f"({shape!r}, {sizes}{guarded}{restarts})".encode())

    @property
    def restarts(self) -> bool:
        """Whether the hardware restarts with constants that are loaded."""
        return self.reload and self.datapath.restarts

    @property
    def latency_cycles(self) -> int:
        """Clocks from the edge that accepts a sample to the edge that can output it; an upper limit in serial."""
        if self.online is not None:
            return online_clocks.latency_cycles(self.datapath)
        if self._is_block:
            lanes = self.samples_per_clock
            return parallel_clocks.block_latency_cycles(self.datapath, lanes, look_ahead=self.look_ahead)
        before = (
            0 if self.decimator is None else decimator_clocks.latency_cycles(self.decimator, self.channels) + self.hold
        )
        before += 0 if self.ahead is None else self.ahead.latency_cycles
        if self.program is None:
            return before + parallel_clocks.latency_cycles(self.built, self.channels, protect=self.protect)
        return before + folded_clocks.latency_cycles(self.program, serial=self.name == "serial", protect=self.protect)

    @property
    def clock_estimate(self) -> float:
        """Estimate of the highest clock of the parallel architecture for one channel, on an ECP5, in Hz."""
        lanes = self.samples_per_clock
        return parallel_clocks.clock_estimate(self.datapath, lanes, look_ahead=self.look_ahead)

    @property
    def reset_cycles(self) -> int:
        """Clocks after a reset until the first sample is accepted, while memories are cleared or a decimator fills."""
        if self.decimator is None:
            return self._cleared_cycles
        filled = decimator_clocks.reset_cycles(self.decimator, self.channels)
        if self.ahead is not None and self.channels > 1:
            return max(self._cleared_cycles, filled, self.ahead.reset_cycles)
        if self.ahead is not None:  # which gives the first sample that the decimator fills with
            filled += self.ahead.reset_cycles + self.ahead.latency_cycles + decimator_clocks.FIRST_SAMPLE
        return max(self._cleared_cycles, filled)

    @property
    def _cleared_cycles(self) -> int:
        if self.program is None:
            return self.channels if self.channels > 1 else 0
        return folded_clocks.reset_cycles(self.program, self.channels)

    @property
    def cycles_per_sample(self) -> int:
        """Clocks between samples at the highest rate, an upper limit in serial.

        Rounded up behind a decimator, and with several samples a clock.
        """
        return -(-self.cycles_per_result // (1 if self.decimator is None else self.decimator.factor))

    @property
    def clocks_per_sample(self) -> float:
        """Clocks between samples at the highest rate, on average; an upper limit in serial.

        A whole number but behind a decimator, and with several samples a clock.
        """
        share = self.samples_per_clock if self.decimator is None else self.decimator.factor
        clocks = self.cycles_per_result
        return clocks / share if clocks % share else clocks // share

    @property
    def cycles_per_result(self) -> int:
        """Clocks between results at the highest rate; an upper limit in serial."""
        behind, program = self._cycles_behind_decimator, self.program
        if self.decimator is None:
            return behind
        each = 1 if self.ahead is None else self.ahead.cycles_per_result
        if self.channels > 1:
            return max(decimator_clocks.cycles_per_result_of_many(self.decimator, each=each), behind)
        if program is None:
            return decimator_clocks.cycles_per_result(self.decimator, each=each)
        overlaps = folded_clocks.overlaps(program, serial=self.name == "serial")
        taken = folded_clocks.taken_cycles(program) if overlaps else behind
        return max(decimator_clocks.cycles_per_result(self.decimator, taken, each=each), behind)

    @property
    def _cycles_behind_decimator(self) -> int:
        if self.online is not None:
            return self.online.interval
        if self.program is None:
            return 1
        return folded_clocks.cycles_per_sample(
            self.program,
            serial=self.name == "serial",
            channels=self.channels,
            reload=self.reload,
            protect=self.protect,
        )

    def component(self) -> Component:
        """Make the hardware; the top module has the name of the datapath."""
        made = self._core()
        if self.decimator is None:
            return made
        from sosmith.hdl.decimation.decimator import DecimatedCore

        ahead = None if self.ahead is None else self.ahead._core(before=True)
        return DecimatedCore(self.datapath, made, ahead, hold=self.hold, opens=self._cleared_cycles)

    def _core(self, *, before: bool = False) -> BlockCore | Core | FoldedCore:
        """Make what works on the datapath's own stages, `before` a decimator or behind it."""
        from sosmith.hdl.block_core import BlockCore
        from sosmith.hdl.core import Core  # only what makes hardware loads Amaranth
        from sosmith.hdl.folded import FoldedCore
        from sosmith.hdl.online.core import OnlineCore
        from sosmith.hdl.status import OF_INPUT, RAIL_ALONE

        if self.online is not None:
            return OnlineCore(self.datapath)
        if self._is_block:
            adders = () if self.look_ahead else self.adders
            return BlockCore(self.datapath, self.samples_per_clock, look_ahead=self.look_ahead, adders=adders)
        given = 0 if self.decimator is None else RAIL_ALONE if self.ahead is None else OF_INPUT
        if self.program is None:
            return Core(
                self.built.behind_decimator,
                self.channels,
                fingerprint=self.fingerprint,
                protect=self.protect,
                adders=self.adders,
                flags_given=given,
                before_decimator=before,
            )
        return FoldedCore(
            self.datapath.behind_decimator,
            self.program,
            serial=self.name == "serial",
            channels=self.channels,
            fingerprint=self.fingerprint,
            protect=self.protect,
            flags_given=given,
            before_decimator=before,
        )


def structure(node: Node) -> tuple[object, ...]:
    """Everything about a node that a new set of constants must not change."""
    constant = node.op in {Op.SCALE, Op.CONSTANT}
    limits = (node.low, node.high) if node.op is Op.CLAMP else ()
    return node.op.value, node.operands, node.frac, 0 if constant else node.parameter, node.parameter_frac, limits


@dataclass(frozen=True, kw_only=True)
class Budget:
    """Time and multiplier blocks available to the hardware.

    Attributes
    ----------
    clock, sample_rate : Fraction
        Clock frequency and sample rate of each channel, in Hz.
    channels : int
        Number of channels.
    reload : bool
        Whether the hardware's constants can be loaded.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`.
    blocks : Blocks
        Multiplier blocks.
    decimate : int
        Samples for each result.
    samples_per_clock : int
        Samples in a beat of the streams.
    hold : bool
        Whether each result behind a decimator is handed out once for each of its samples.
    folds : bool
        Whether a shared multiplier is allowed, whatever it is made of.
    """

    clock: Fraction
    sample_rate: Fraction
    channels: int = 1
    reload: bool = False
    protect: str = "none"
    blocks: Blocks = NO_LIMIT
    decimate: int = 1
    samples_per_clock: int = 1
    hold: bool = False
    folds: bool = True

    @property
    def adders(self) -> bool:
        """Whether no product by a constant may take a multiplier block in the parallel architecture."""
        return self.blocks.available == 0 and not self.reload

    @property
    def cycles(self) -> int:
        """Clocks available for one result of one channel, or for one beat of them."""
        return int(self.clock * self._at_once / (self.sample_rate * self.channels))

    @property
    def _at_once(self) -> int:
        """Samples that a result, or a beat of them, stands for."""
        return self.decimate * self.samples_per_clock

    def check(self, architecture: Architecture) -> None:
        """Check that `architecture` keeps up.

        Raises
        ------
        ShortfallError
            If the architecture takes more clocks than available; gives the highest rate that it can achieve.
        """
        needed = architecture.cycles_per_result
        if needed <= self.cycles:
            return
        most, wanted = _told_apart(self.clock * self._at_once / (needed * self.channels), self.sample_rate)
        many = f" with {self.channels:,} channels" if self.channels > 1 else ""
        per = "a sample" if self._at_once == 1 else f"for {self._at_once} samples"
        raise ShortfallError(
            f"the {architecture.name} architecture takes {needed:,} clock{'s' * (needed > 1)} {per}: at a clock of "
            f"{_in_full(self.clock, 12)} Hz{many} the sample rate must be at most {most} Hz, not {wanted} Hz"
        )


def _told_apart(most: Fraction, wanted: Fraction) -> tuple[str, str]:
    """Texts of two rates with enough digits to tell them apart; `most` is rounded down, so that it is achievable."""
    for digits in range(6, 17):
        context = decimal.Context(prec=digits, rounding=decimal.ROUND_FLOOR)
        floor = context.divide(decimal.Decimal(most.numerator), decimal.Decimal(most.denominator))
        texts = f"{floor:,f}", _in_full(wanted, digits)
        if texts[0] != texts[1]:
            break
    return texts


def _in_full(rate: Fraction, digits: int) -> str:
    """Text of a rate with so many significant digits, and without an exponent."""
    return f"{decimal.Decimal(f'{float(rate):.{digits}g}'):,f}"


def blocks_for(wanted: int | None, board: Board | None) -> Blocks:
    """Multiplier blocks that a core may take: as the specification says, or else all that the board has."""
    if board is None:
        return Blocks(wanted)
    device = board.device
    return Blocks(device.multipliers if wanted is None else wanted, device.factor_bits or MULTIPLIER_BITS)


def candidates(wanted: str, blocks: Blocks, *, folds: bool = True) -> tuple[str, ...]:
    """Architectures to try for the one that the specification asks for, the smallest first.

    Without multiplier blocks, shifts and additions are smaller than a multiplier made of LUT4; `folds` says whether
    such a multiplier is allowed.
    """
    if wanted != "auto":
        return (wanted,)
    if not folds:
        return ("serial", "parallel")
    return ("serial", "folded", "parallel") if blocks.available == 0 else ("folded", "parallel")


def digit_bits_on(board: Board | None, name: str) -> int:
    """Width of a digit in the architecture `name`: as wide as the multiplier block of the board takes it."""
    if board is None or name != "folded" or not board.device.factor_bits:
        return DIGIT_BITS
    return board.device.factor_bits - 1


def objective_of(name: str, board: Board | None, *, adders: bool = False) -> Objective:
    """Return what word lengths and a realization are chosen for in the architecture `name`.

    `adders` says that no product by a constant may take a multiplier block in the parallel one.
    """
    if name == "online":
        return OnlineUnits()
    if name != "parallel":
        return ShortProgram(name, digit_bits_on(board, name))
    return FEW_ADDERS if adders else SMALL_AREA


def fitting(
    name: str,
    budget: Budget,
    datapath: Datapath,
    board: Board | None = None,
    *,
    look_ahead: bool = False,
    ahead: Architecture | None = None,
) -> Architecture:
    """Return the architecture `name` of `datapath`, for a board if there is one.

    `ahead` is that of the calibration before its decimator.

    Raises
    ------
    ShortfallError
        If the datapath cannot be folded, or the architecture does not keep up.
    """
    digit_bits = digit_bits_on(board, name)
    architecture = Architecture(
        name,
        datapath,
        budget.channels,
        budget.reload,
        budget.protect,
        digit_bits,
        budget.blocks,
        budget.samples_per_clock,
        look_ahead,
        budget.hold,
        ahead,
    )
    budget.check(architecture)
    return architecture


def reason_for(architecture: Architecture, budget: Budget, *, asked: bool, board: Board | None, refused: str) -> str:
    """Explain the choice of an architecture; `refused` says why a smaller one was rejected, if one was tried."""
    name, needed = architecture.name, architecture.cycles_per_result
    per = "a sample" if budget.decimate == 1 else f"for {budget.decimate} samples"
    smallest = "the smallest that keeps up"
    if board is not None:
        there = f"{board.device.multipliers} multipliers" if board.device.multipliers else "no multipliers"
        smallest += f" on {board.name}, whose {board.device.title} has {there}"
    why = "asked for in the specification" if asked else refused or smallest
    if architecture.name == "parallel":
        lanes = architecture.samples_per_clock
        several = f", {lanes} samples a clock" if lanes > 1 else ""
        return f"{name}: {why}{several}{_made_of_adders(architecture)}"
    return f"{name}: {why}; takes {needed:,} of {budget.cycles:,} clocks {per}"


def _made_of_adders(architecture: Architecture) -> str:
    """Say which products are made of adders, and why."""
    count, there = sum(map(len, architecture.adders)), architecture.blocks.available
    if not count:
        return ""
    if architecture.look_ahead:
        return f"; its {count} product{'s' * (count > 1)} by constants made of adders, with registers between them"
    blocks = "without multiplier blocks" if not there else f"with at most {there} multiplier blocks"
    return f"; {blocks}, {count} product{'s' * (count > 1)} by constants made of adders"
