"""Architectures in which one unit runs a program: what folded and serial have in common."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.blocks import NO_LIMIT, Blocks
from sosmith.gen.fpga.boards import Board
from sosmith.gen.word_lengths.objective import Objective, ShortProgram, folded, unsuitable
from sosmith.hdl.plan import folded_clocks
from sosmith.hdl.plan.instructions import encoded, instruction_bits
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.folding.values import FoldingError
from sosmith.model.dataflow.program import Program
from sosmith.model.errors import ShortfallError
from sosmith.model.reload.registers import BITS

if TYPE_CHECKING:
    from amaranth.lib.wiring import Component

SPARE_ACCUMULATOR_BITS = 2
"""Additional bits, beyond the needs of its own program, in hardware that can load other programs."""

SPARE_WORDS = 4
"""Words of memory beyond the needs of its own program, in hardware that can load other programs."""

SPARE_INSTRUCTIONS = 4
"""A replaceable program has spare instructions: one for each group of this many."""

_TRIALS = 100
"""Orders of sums that are tried for a program with two products a clock, where words have to be waited for."""


def _shortest(datapath: Datapath, digit_bits: int) -> Program:
    """Return the shortest program with two products a clock.

    Its constants are fixed: `hardware.reload` leaves `hardware.multipliers` to the hardware.
    """
    return folded(datapath, digit_bits, products=2, trials=_TRIALS)


@dataclass(frozen=True)
class SharedUnit(Architecture):
    """One multiplier or two, and one accumulator, run a program.

    Attributes
    ----------
    bit_serial : bool
        Of the class: whether factors come bit by bit, so that the unit has no multiplier.
    """

    bit_serial: ClassVar[bool]
    checked = "the program computes the datapath's graphs, instruction by instruction"

    @classmethod
    def objective(cls, board: Board | None, *, adders: bool = False, blocks: Blocks = NO_LIMIT) -> Objective:
        """Return the length of the program."""
        del adders
        return ShortProgram(
            cls.terms.name,
            cls.digit_bits_on(board),
            bit_serial=cls.bit_serial,
            products=cls.products_with(blocks),
        )

    @cached_property
    def program(self) -> Program:
        """Program of the shared unit.

        Raises
        ------
        ShortfallError
            If the datapath cannot be folded.
        """
        try:
            if self.products_with(self.blocks) > 1:
                return _shortest(self.datapath.behind_decimator, self.digit_bits)
            made = folded(self.datapath.behind_decimator, self.digit_bits, spare_words=SPARE_WORDS * self.reload)
            for digit_bits in range(self.digit_bits - 1, 0, -1):
                if not self.reload or instruction_bits(made) <= BITS:  # one register holds an instruction
                    break
                made = folded(self.datapath.behind_decimator, digit_bits, spare_words=SPARE_WORDS)
        except FoldingError as error:
            raise ShortfallError(unsuitable(self.name, error)) from None
        if not self.reload:
            return made
        roomy = replace(made, accumulator_bits=made.accumulator_bits + SPARE_ACCUMULATOR_BITS)
        return roomy.padded(len(made.instructions) + len(made.instructions) // SPARE_INSTRUCTIONS)

    @property
    def multiplier_blocks(self) -> int:
        """Multiplier blocks that it takes, without what stands before a decimator."""
        return 0 if self.bit_serial else self.products_with(self.blocks)

    @property
    def bank_size(self) -> tuple[int, int]:
        """Number of instructions, and the number of bits of each."""
        return len(self.program.instructions), instruction_bits(self.program)

    def bank(self, datapath: Datapath, program: Program | None) -> list[int]:
        """Return the instructions of a program."""
        del datapath
        assert program is not None
        return [encoded(instruction, program) for instruction in program.instructions]

    def clocks_of(self, other: Program) -> int:
        """Clocks between samples of one channel at the highest rate with another program that is fixed."""
        return folded_clocks.cycles_per_sample(other, serial=self.bit_serial, protect=self.protect)

    @property
    def _latency_cycles(self) -> int:
        return folded_clocks.latency_cycles(self.program, serial=self.bit_serial, protect=self.protect)

    @property
    def _cycles_per_sample(self) -> int:
        return folded_clocks.cycles_per_sample(
            self.program,
            serial=self.bit_serial,
            channels=self.channels,
            reload=self.reload,
            protect=self.protect,
        )

    @property
    def _cleared_cycles(self) -> int:
        return folded_clocks.reset_cycles(self.program, self.channels)

    @property
    def _taken_cycles(self) -> int:
        return folded_clocks.taken_cycles(self.program, serial=self.bit_serial, protect=self.protect)

    def _core(self, *, before: bool = False) -> Component:
        from sosmith.hdl.cores.folded import FoldedCore  # only what makes hardware loads Amaranth

        return FoldedCore(
            self.datapath.behind_decimator,
            self.program,
            serial=self.bit_serial,
            channels=self.channels,
            fingerprint=self.fingerprint,
            protect=self.protect,
            lock=self.reload_lock,
            pins=self.bank_pins,
            flags_given=self._flags_given,
            before_decimator=before,
        )
