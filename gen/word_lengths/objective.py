"""What word lengths and realizations are chosen for: a small area, or a short program, by the architecture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from typing import Protocol

from sosmith.gen.word_lengths.cost import (
    LUTS_OF_A_BLOCK,
    MULTIPLIER_BITS,
    Cost,
    area_by_digits,
    area_of,
    bits_by_digits,
    cost_of,
    cost_of_graphs,
    passed_bits,
)
from sosmith.hdl.plan.block_products import blocks_of, with_blocks
from sosmith.hdl.plan.sharing.sharing import sharing
from sosmith.model.dataflow.adder_graph import scalings
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.folding.fold import columns_of, program
from sosmith.model.dataflow.folding.values import FoldingError
from sosmith.model.dataflow.graph import Graph, Op
from sosmith.model.dataflow.program import Program, serial_clocks
from sosmith.model.dataflow.scheduling import Column
from sosmith.model.errors import ShortfallError

_AREAS_OF_AN_INSTRUCTION = 4096
"""Estimated area of the parallel core, in LUT4, that weighs as much as one instruction while word lengths are trimmed.

Far more than one instruction is worth: it decides between steps that save no instruction yet. Shorter words lead to
those that do. Without it, the program of flange_wear_locomotive is some steps longer.
"""

_LUTS_FOR_A_PIECE = 40
"""LUT4 that a block for a piece of a product counts as: about what its sum with the other pieces takes. A core with
look-ahead needs about as many blocks as a small FPGA has."""

_WORDS, _ACCUMULATOR_BITS = Fraction(1, 1 << 16), Fraction(1, 1 << 24)
"""Weights of a word of memory and a bit of the accumulator: they decide between programs of the same length."""


class Objective(Protocol):
    """The size that a design should have as little of."""

    def __hash__(self) -> int:
        """Return the same for the same kind of size."""

    @property
    def best(self) -> str:
        """What the smallest design has, for a sentence."""

    @property
    def beyond(self) -> str:
        """What is said of realizations that `least` excludes."""

    @property
    def unsuited(self) -> str:
        """What is said of realizations for which there is no `least`."""

    @property
    def hopeless(self) -> float:
        """Ratio to the smallest size beyond which a plan is not trimmed."""

    @property
    def negligible(self) -> float:
        """Size that a design may have beyond the smallest one, for a smaller error."""

    @property
    def few_digits(self) -> bool:
        """Whether a coefficient of fewer signed digits takes less, though it has as many bits."""

    @property
    def floors_products(self) -> bool:
        """Whether a product may drop bits by itself, before it is added to others."""

    @property
    def exact_taps(self) -> bool:
        """Whether the hardware has no coefficients, so that taps of an FIR filter must be exact."""

    @property
    def tied(self) -> bool:
        """Whether sections of the same structure share hardware, so that they have the same formats."""

    @property
    def factor_bits(self) -> int | None:
        """Bits of a constant, with its sign, beyond which a product takes more; None if there is no such step."""

    def of_graph(self, graph: Graph) -> float:
        """Estimate what one stage adds to the size; infinite if it does not suit."""

    def of_datapath(self, datapath: Datapath) -> float:
        """Return the size of a whole design; infinite if it does not suit."""

    def least(self, graphs: Sequence[Graph]) -> float:
        """Bound the size from below for any word lengths, given stages with other ones.

        Raises
        ------
        ShortfallError
            If the stages cannot suit with any.
        """

    def size_text(self, datapath: Datapath) -> str:
        """Return the size of a design in words."""


@dataclass(frozen=True)
class SmallArea:
    """Estimated area of the parallel architecture: LUT4 on an ECP5, see `sosmith.gen.word_lengths.cost`."""

    best = "the smallest estimated area"
    beyond = "more in multiplier blocks alone"
    unsuited = "not for this filter"
    hopeless = 2.5  # trimming saved less than half in every design seen
    negligible = 0.0
    few_digits = False
    floors_products = True
    exact_taps = False
    tied = False
    factor_bits = MULTIPLIER_BITS

    def of_graph(self, graph: Graph) -> float:
        """Return the area of the graph's operators, in LUT4."""
        return area_of(graph)

    def of_datapath(self, datapath: Datapath) -> float:
        """Return the area of all operators, in LUT4."""
        return cost_of(datapath).area

    def least(self, graphs: Sequence[Graph]) -> float:
        """Return the area of a multiplier block for each product.

        Products by powers of two take none. Those that rounding to few bits makes powers of two are counted all the
        same.
        """
        return LUTS_OF_A_BLOCK * sum(node.op is Op.SCALE for graph in graphs for node in graph.nodes)

    def size_text(self, datapath: Datapath) -> str:
        """Return the area in words."""
        return f"{cost_of(datapath).area:,} LUT4 with a multiplier block counted as {LUTS_OF_A_BLOCK}"


SMALL_AREA = SmallArea()
"""For the parallel architecture."""


@dataclass(frozen=True)
class SharedArea(SmallArea):
    """Estimated area of the multiplexed architecture: sections of the same structure count once."""

    tied = True

    def of_datapath(self, datapath: Datapath) -> float:
        """Return the area of all operators, in LUT4; infinite if no sections share any."""
        try:
            return self._cost(datapath).area
        except ValueError:
            return math.inf

    def least(self, graphs: Sequence[Graph]) -> float:
        """Return the area of a multiplier block for each product of the largest section: others may share them."""
        return max((super(SharedArea, self).least([graph]) for graph in graphs), default=0)

    def size_text(self, datapath: Datapath) -> str:
        """Return the area in words."""
        area = self._cost(datapath).area
        return f"{area:,} LUT4 with shared sections counted once and a multiplier block as {LUTS_OF_A_BLOCK}"

    def _cost(self, datapath: Datapath) -> Cost:
        return cost_of_graphs(sharing(datapath).graphs)


SHARED_AREA = SharedArea()
"""For the multiplexed architecture."""


@dataclass(frozen=True)
class FewAdders:
    """Estimated area of the parallel architecture whose products by constants are made of adders."""

    best = "the smallest estimated area"
    beyond = "more in multiplier blocks alone"
    unsuited = "not for this filter"
    hopeless = SmallArea.hopeless
    negligible = 0.0
    few_digits = True
    floors_products = True
    exact_taps = False
    tied = False
    factor_bits = None

    def of_graph(self, graph: Graph) -> float:
        """Return the area of the graph's operators, in LUT4, by the digits of its constants."""
        return area_by_digits(graph)

    def of_datapath(self, datapath: Datapath) -> float:
        """Return the area of all operators, in LUT4, with the adders that products are made of.

        Bits of sums that take no adder are left out, as they are of the sums of products: some may have been made such.
        """
        graphs = [stage.graph for stage in datapath.stages]
        cost = cost_of(datapath, [*map(scalings, graphs)])
        return replace(cost, adder_bits=cost.adder_bits - sum(map(passed_bits, graphs))).area

    def least(self, graphs: Sequence[Graph]) -> float:
        """Return 0: every constant may turn out to be a power of two."""
        return 0

    def size_text(self, datapath: Datapath) -> str:
        """Return the area in words."""
        return f"{self.of_datapath(datapath):,} LUT4 with products by constants made of adders"


FEW_ADDERS = FewAdders()
"""For the parallel architecture without multiplier blocks."""


@dataclass(frozen=True)
class FewSums:
    """Estimated area of the parallel architecture with look-ahead, whose products take multiplier blocks in pieces.

    Attributes
    ----------
    bits : int
        Bits of each operand of a block, signed.
    """

    bits: int

    best = "the smallest estimated area"
    beyond = "more in multiplier blocks alone"
    unsuited = "not for this filter"
    hopeless = SmallArea.hopeless
    negligible = 0.0
    few_digits = False
    floors_products = True
    exact_taps = False
    tied = False

    @property
    def factor_bits(self) -> int:
        """Bits of a block: what a constant has beyond takes an adder."""
        return self.bits

    def of_graph(self, graph: Graph) -> float:
        """Return the area of the graph's operators, in LUT4: of sums, and a little for each block."""
        split, pieces = with_blocks(graph, self._in_blocks(graph), self.bits)
        cost = cost_of_graphs([split], [scalings(split) - pieces], bits_by_digits)
        return cost.luts + _LUTS_FOR_A_PIECE * cost.multiplier_blocks

    def _in_blocks(self, graph: Graph) -> list[int]:
        """Return the products that are not smaller as sums."""
        return [
            index
            for index in scalings(graph)
            if bits_by_digits(graph, [index]) > _LUTS_FOR_A_PIECE * blocks_of(graph, graph.nodes[index], self.bits)
        ]

    def of_datapath(self, datapath: Datapath) -> float:
        """Return the area of all operators."""
        return sum(self.of_graph(stage.graph) for stage in datapath.stages)

    def least(self, graphs: Sequence[Graph]) -> float:
        """Return 0: every constant may turn out to be a power of two."""
        return 0

    def size_text(self, datapath: Datapath) -> str:
        """Return the area in words."""
        return f"{self.of_datapath(datapath):,.0f} LUT4 with a multiplier block counted as {_LUTS_FOR_A_PIECE}"


@dataclass(frozen=True)
class ShortProgram:
    """Length of the program of the folded and serial architectures, then its memory, then its accumulator.

    Attributes
    ----------
    architecture : str
        Its name, for sentences.
    digit_bits : int
        Width of a digit.
    bit_serial : bool
        Whether an instruction takes a clock for each bit of its factor, instead of one.
    products : int
        Products at a clock, 1 or 2.
    """

    architecture: str
    digit_bits: int
    bit_serial: bool = False
    products: int = 1

    negligible = 1 / 128  # bits of words that take no instruction
    few_digits = False
    floors_products = False  # products are added up with all their bits
    exact_taps = False
    tied = False
    beyond = "longer even with one digit for each value"
    unsuited = "not to be folded"
    hopeless = 1.5  # trimming saved less than a fifth in every design seen

    @property
    def factor_bits(self) -> int | None:
        """Bits of a digit, but where each bit takes a clock."""
        return None if self.bit_serial else self.digit_bits

    @property
    def best(self) -> str:
        """What the smallest design has, for a sentence."""
        return "the fewest clocks of multiplication" if self.bit_serial else "the shortest program"

    def of_graph(self, graph: Graph) -> float:
        """Count the clocks of the graph's products, each with a little of its area; infinite if it cannot be folded."""
        try:
            columns = columns_of(graph, self.digit_bits)
        except FoldingError:
            return math.inf
        return sum(map(self._clocks, columns)) + area_of(graph) / _AREAS_OF_AN_INSTRUCTION

    def of_datapath(self, datapath: Datapath) -> float:
        """Return the clocks of all instructions, with memory and accumulator as fractions of a clock.

        Infinite if it cannot be folded.
        """
        try:
            made = folded(datapath, self.digit_bits, products=self.products)
        except FoldingError:
            return math.inf
        clocks = made.serial_cycles if self.bit_serial else len(made.instructions)
        return float(clocks + made.words * _WORDS + made.accumulator_bits * _ACCUMULATOR_BITS)

    def least(self, graphs: Sequence[Graph]) -> float:
        """Count the products of values with one digit each.

        Raises
        ------
        ShortfallError
            If a stage cannot be folded.
        """
        try:
            columns = [column for graph in graphs for column in columns_of(graph, digit_bits=256)]
        except FoldingError as error:
            raise ShortfallError(unsuitable(self.architecture, error)) from None
        return sum(-(-len(column.products) // self.products) for column in columns)

    def size_text(self, datapath: Datapath) -> str:
        """Return the length of the program, its memory and its accumulator in words."""
        made = folded(datapath, self.digit_bits, products=self.products)
        length = f"at most {made.serial_cycles:,}" if self.bit_serial else f"{len(made.instructions):,} instructions"
        return f"{length}, {made.words:,} words of memory, an accumulator of {made.accumulator_bits} bits"

    def _clocks(self, column: Column) -> int:
        """Clocks of a column's instructions; one without products still takes one, which ends it."""
        if not self.bit_serial:
            return max(1, -(-len(column.products) // self.products))
        clocks = [
            self.digit_bits + 1 if product.other is not None else serial_clocks(product.constant)
            for product in column.products
        ]
        return sum(clocks) or 1


def folded(datapath: Datapath, digit_bits: int, *, spare_words: int = 0, products: int = 1, trials: int = 0) -> Program:
    """Fold a datapath as `sosmith.model.dataflow.folding.fold.program` does; the same one is folded once."""
    return _folded(datapath, digit_bits, spare_words, products, trials)


@lru_cache(maxsize=16)  # the size of a datapath, its clocks and its hardware ask for the same program
def _folded(datapath: Datapath, digit_bits: int, spare_words: int, products: int, trials: int) -> Program:
    return program(datapath, digit_bits, spare_words=spare_words, products=products, trials=trials)


def unsuitable(architecture: str, error: FoldingError) -> str:
    """Return the sentence for a datapath that cannot be folded."""
    return f"the realization must suit the {architecture} architecture: {error}; parallel takes every realization"
