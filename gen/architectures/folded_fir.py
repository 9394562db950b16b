"""The folded architecture of an FIR filter: one multiplier, and samples in a ring of memory."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.blocks import NO_LIMIT, Blocks
from sosmith.gen.architectures.fir_steps import FewSteps
from sosmith.gen.fpga.boards import Board
from sosmith.gen.specification.combinations import FOLDED
from sosmith.gen.word_lengths.cost import Multiplication, Operand
from sosmith.gen.word_lengths.objective import Objective
from sosmith.hdl.plan.tap_steps import StepsInTurn, TapSteps, tap_steps
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.downsampler import Downsampler
from sosmith.model.dataflow.program import Program
from sosmith.model.errors import ShortfallError

if TYPE_CHECKING:
    from amaranth.lib.wiring import Component


@dataclass(frozen=True)
class FoldedFir(Architecture):
    """One multiplier takes the steps of each result, or of every N-th one alone, a step at each clock."""

    terms = FOLDED
    is_filled = True
    checked = "each result is the one of the datapath's graphs, for all samples, stalls and resets"

    @classmethod
    def is_tried(cls, blocks: Blocks) -> bool:
        """Return True: if there is no multiplier block, synthesis makes one of LUT4."""
        del blocks
        return True

    @classmethod
    def objective(cls, board: Board | None, *, adders: bool = False, blocks: Blocks = NO_LIMIT) -> Objective:
        """Return the number of steps."""
        del board, adders, blocks
        return FewSteps()

    @cached_property
    def plan(self) -> TapSteps:
        """The steps, and their clocks."""
        return tap_steps(self.datapath, loadable=self.reload)

    @property
    def _down(self) -> Downsampler:
        down = self.datapath.downsampler
        assert down is not None
        return down

    @property
    def copies_per_result(self) -> int:
        """Times that each result is handed out."""
        return self._down.factor if self.hold else 1

    @cached_property
    def in_turn(self) -> StepsInTurn:
        """The steps as the multiplier takes them."""
        return self._steps()

    def _steps(self, *, block: int | None = None) -> StepsInTurn:
        return StepsInTurn((self.plan,), self.datapath.inputs[0], block)

    @property
    def multiplier_blocks(self) -> int:
        """Multiplier blocks that it takes: several where a sum of two samples or a coefficient is too wide for one."""
        return blocks_of(self.in_turn, self.blocks.bits)

    @property
    def memory_bits(self) -> int:
        """Bits of the samples that it keeps of a channel, once."""
        return self.in_turn.words * self.datapath.inputs[0].bits

    @property
    def bank_size(self) -> tuple[int, int]:
        """Number of words in a bank of coefficients, and the number of bits used in each."""
        return len(self.plan.steps), self.plan.factor_bits

    def bank(self, datapath: Datapath, program: Program | None = None) -> list[int]:
        """Return the words of a bank: the coefficient of each step."""
        del program
        other = tap_steps(datapath, loadable=True)
        if other.frac != self.plan.frac or [step[1:] for step in map(astuple, other.steps)] != [
            step[1:] for step in map(astuple, self.plan.steps)
        ]:
            raise ShortfallError("the set must fit the hardware: its steps must be those of the taps that it has")
        return [step.coefficient & (1 << self.plan.factor_bits) - 1 for step in other.steps]

    @property
    def _latency_cycles(self) -> int:
        return self.in_turn.latency_cycles(self.channels)

    @property
    def _cycles_per_sample(self) -> int:
        return self.in_turn.cycles_per_result(self._down.factor, self.channels)

    @property
    def _cleared_cycles(self) -> int:
        return self.in_turn.reset_cycles(self.channels)

    @property
    def cycles_per_result(self) -> int:
        """Clocks between results of a channel at the highest rate."""
        return self._cycles_per_sample

    @property
    def cycles_per_sample(self) -> int:
        """Clocks between samples at the highest rate, on average, rounded up."""
        return -(-self.cycles_per_result // self._down.factor)

    @property
    def clocks_per_sample(self) -> float:
        """Clocks between samples at the highest rate, on average."""
        clocks, share = self.cycles_per_result, self._down.factor
        return clocks / share if clocks % share else clocks // share

    def _core(self, *, before: bool = False) -> Component:
        del before
        from sosmith.hdl.cores.ring import RingCore  # only what makes hardware loads Amaranth

        return RingCore(
            self.datapath,
            self.channels,
            block=self.in_turn.block,
            copies=self.copies_per_result,
            fingerprint=self.fingerprint,
            lock=self.reload_lock,
            protect=self.protect,
        )

    def reason(self, why: str, available: int) -> str:
        """Say in a sentence that it was chosen and `why`, with `available` clocks for each result."""
        return (
            f"{self.name}: {why}; takes {self.cycles_per_result:,} of {available:,} clocks "
            f"{'a sample' if self._down.factor == 1 else f'for {self._down.factor} samples'}"
        )


@dataclass(frozen=True)
class NarrowFir(FoldedFir):
    """The same with one multiplier block, or no more than the specification names: wider factors have digits.

    Not where other coefficients can be loaded: they may have more digits.
    """

    @cached_property
    def in_turn(self) -> StepsInTurn:
        """The steps as the multiplier takes them."""
        whole, fixed = self._steps(), not self.reload
        narrow = not fixed or blocks_of(whole, self.blocks.bits) <= (self.blocks.asked or 1)
        return whole if narrow else self._steps(block=self.blocks.bits)


def blocks_of(steps: StepsInTurn, bits: int) -> int:
    """Count the multiplier blocks, whose operands have so many bits, that steps need."""
    data, factor = (Operand(each, signed=True) for each in (steps.data_bits, steps.factor_bits))
    return Multiplication(data, factor).blocks_of(bits)
