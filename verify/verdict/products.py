"""How the hardware of a parallel core makes its products by constants: which by a multiplication, which of what sums.

The SystemVerilog is looked at alone. A sum of two multiples of the same word is a multiple of it::

    assign x_times_5 = $signed(x) + $signed({ x, 2'h0 });                     5 = 1 + 4
    assign product = $signed({ x_times_5, 4'h0 }) - $signed(x_times_5);      75 = 80 - 5

Which node of the certificate's graph `x` has the code of follows from its form. In a pipeline, several words may have
it, one clock after the other, each with sums of its own. Every product must be there: as a multiplication by its
constant, or as a multiple that sums make, shifted.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from typing import NamedTuple

from sosmith.verify.certificate_file import Operation
from sosmith.verify.parallel.check import Reading
from sosmith.verify.parallel.evaluation import is_signed
from sosmith.verify.parallel.graph_codes import CodeNode
from sosmith.verify.parallel.split import sliced
from sosmith.verify.program.normal_form import Form
from sosmith.verify.reader.syntax import Bits, Choice, Expression, Joined, Load, Number, Operator, Statement
from sosmith.verify.verdict.operators import bits, is_product


class Multiple(NamedTuple):
    """A multiple of the word that bits of a net are."""

    word: Bits
    factor: int


class Sum(NamedTuple):
    """A sum or a difference of two multiples of a word, each a smaller multiple that is shifted to the left."""

    factors: tuple[int, int]
    shifts: tuple[int, int]
    subtract: bool


@dataclass(frozen=True)
class Products:
    """How products are made.

    Attributes
    ----------
    multiplied : tuple of bool or None
        Of each product in the order of the graphs, whether it is a multiplication; None if it takes wires only.
    adder_bits : int
        Bits of the sums that the others are made of.
    """

    multiplied: tuple[bool | None, ...]
    adder_bits: int


def products_of(reading: Reading) -> Products | None:
    """Return how hardware that is proven makes the products of its graph; None if that is not seen of one of them.

    Several samples a clock, and look-ahead, are None: the sums there are not those of the graph.
    """
    nodes = reading.graph.nodes
    if len(reading.graph.lanes) > 1 or reading.graph.turned:
        return None
    words = _Words(reading)
    groups: dict[int, list[int]] = {}
    for index, node in enumerate(nodes):
        if node.entry.op is Operation.SCALE:
            groups.setdefault(_operand(nodes, index), []).append(index)
    multiplied: dict[int, bool | None] = {}
    adder_bits = 0
    by_operand = {operand: {nodes[i].entry.parameter for i in products} for operand, products in groups.items()}
    for operand, made in words.made_of(by_operand).items():
        products = groups[operand]
        factors = {index: nodes[index].entry.parameter for index in products}
        multipliers = {factor for each in made for factor in each.multiplied}
        multiplied |= {index: _kind(factor, multipliers) for index, factor in factors.items()}
        needed = {_odd(factors[index]) for index in products if multiplied[index] is False}
        if needed - {factor for each in made for factor in each.sums}:
            return None
        low, high = nodes[operand].entry.low, nodes[operand].entry.high
        sums = [(factor, total) for each in made for factor, total in each.reached(needed).items()]
        adder_bits += sum(_bits(factor, total, low, high) for factor, total in sums)
    of_two = {
        i: True for i, node in enumerate(nodes) if is_product(node.entry, [nodes[k].entry for k in node.operands])
    }
    return Products(tuple((of_two | multiplied)[index] for index in sorted(of_two)), adder_bits)


def _operand(nodes: Sequence[CodeNode], index: int) -> int:
    """Return the node whose code a product multiplies."""
    (index,) = nodes[index].operands
    while nodes[index].entry.op is Operation.SHIFT:
        (index,) = nodes[index].operands
    return index


def _kind(factor: int, multipliers: Set[int]) -> bool | None:
    """Whether a product is a multiplication; None for one by 0 or a power of two, which takes wires only."""
    wires = factor >= 0 and factor & (factor - 1) == 0
    return factor in multipliers or (None if wires else False)


def _odd(factor: int) -> int:
    return factor // (factor & -factor) if factor else 0


def _bits(factor: int, made: Sum, low: int, high: int) -> int:
    """Return the bits of a sum that take an adder: not its lowest ones, where one of both words has none.

    Where the first word of a difference has none, the bits of the other one are still to be subtracted.
    """
    ends = sorted((factor * low, factor * high))
    width = max((-end - 1 if end < 0 else end).bit_length() for end in ends) + (ends[0] < 0)
    free = made.shifts[1] or (0 if made.subtract else made.shifts[0])
    return width - free


@dataclass
class _Made:
    """What is made of a word: by which constants it is multiplied, and which of its multiples are sums."""

    multiplied: set[int]
    sums: dict[int, Sum]

    def reached(self, needed: Set[int]) -> dict[int, Sum]:
        """Return the sums that odd multiples are made of, as far as they are made of this word."""
        reached: dict[int, Sum] = {}
        pending = [*needed]
        while pending:
            factor = pending.pop()
            if factor in self.sums and factor not in reached:
                reached[factor] = self.sums[factor]
                pending += self.sums[factor].factors
        return reached


class _Words:
    """The words that hardware multiplies, and what they are in the graph."""

    def __init__(self, reading: Reading) -> None:
        self._reading, self._netlist = reading, reading.netlist
        self._multiples: dict[Bits, Multiple] = {}
        self._open: set[Bits] = set()
        self._made: dict[Bits, _Made] = {}
        self._codes: dict[Bits, list[Form]] = {}
        for value in self._values():
            if isinstance(value, Operator) and value.symbol == "*":
                self._multiply(value)
            elif isinstance(value, Operator) and value.symbol in {"+", "-"}:
                self._add(value)

    def made_of(self, factors: Mapping[int, Set[int]]) -> dict[int, list[_Made]]:
        """Return what is made of each word that has a node's code, for some nodes and the factors they are taken by."""
        all_made: dict[int, list[_Made]] = {operand: [] for operand in factors}
        for word, made in self._made.items():
            multiples = made.multiplied | made.sums.keys()
            likely = [each for each in factors if multiples & {*factors[each], *map(_odd, factors[each])}]
            nodes = [operand for operand in likely if self._is_code(word, operand)]
            whole = [operand for operand in nodes if not self._lacks_sign(word, operand)]
            for operand in whole or nodes:
                all_made[operand].append(made)
        return all_made

    def _is_code(self, word: Bits, operand: int) -> bool:
        """Whether bits of a net are a node's code for a sample somewhere in the pipeline, or all of it but the sign."""
        graph, pipeline, width = self._reading.graph, self._reading.pipeline, self._netlist.width(word)
        entry = graph.nodes[operand].entry
        return width >= bits(entry) - (entry.low < 0) and any(
            pipeline.same(code, graph.codes[operand], width) for code in self._codes_of(word)
        )

    def _lacks_sign(self, word: Bits, operand: int) -> bool:
        """Whether a word has no place for the sign of a node, which is 0 where it never is negative."""
        return self._netlist.width(word) < bits(self._reading.graph.nodes[operand].entry)

    def _codes_of(self, word: Bits) -> list[Form]:
        if word not in self._codes:
            self._codes[word] = [*self._reading.pipeline.codes_of(word)]
        return self._codes[word]

    def _multiply(self, value: Operator) -> None:
        for one, other in (value.operands, value.operands[::-1]):
            constant, multiple = _constant(one), self._multiple(other)
            if constant is not None and multiple is not None:
                self._of(multiple.word).multiplied.add(constant * multiple.factor)

    def _add(self, value: Operator) -> None:
        left, right = (self._multiple(operand) for operand in value.operands)
        total = self._sum(value, left, right)
        if total is None or left is None or right is None or not total.factor & 1:
            return
        factors, shifts = zip(*(_split(each.factor) for each in (left, right)), strict=True)
        made = Sum((factors[0], factors[1]), (shifts[0], shifts[1]), value.symbol == "-")
        self._of(total.word).sums.setdefault(total.factor, made)

    def _of(self, word: Bits) -> _Made:
        return self._made.setdefault(word, _Made(set(), {}))

    def _values(self) -> Iterator[Expression]:
        """Yield all expressions, and those inside them."""
        netlist = self._netlist
        pending: list[Expression] = [driver.value for drivers in netlist.drivers.values() for driver in drivers]
        for register in netlist.registers.values():
            pending += _loads(register.statements)
        while pending:
            value = pending.pop()
            yield value
            if isinstance(value, Joined):
                pending += value.parts
            elif isinstance(value, Operator):
                pending += value.operands

    def _multiple(self, value: Expression) -> Multiple | None:
        """Return what a value is a multiple of: a word, at least of itself; None if it is no bits of a net."""
        if isinstance(value, Operator) and value.symbol == "signed":
            return self._multiple(value.operands[0])
        if isinstance(value, Operator) and value.symbol in {"+", "-"}:
            return self._sum(value, *(self._multiple(operand) for operand in value.operands))
        if isinstance(value, Joined):
            return self._shifted(value.parts)
        return self._followed(value) if isinstance(value, Bits) else None

    def _sum(self, value: Operator, left: Multiple | None, right: Multiple | None) -> Multiple | None:
        if left is None or right is None or left.word != right.word:
            return None
        factor = left.factor + right.factor if value.symbol == "+" else left.factor - right.factor
        return Multiple(left.word, factor) if factor else None

    def _shifted(self, parts: Sequence[Expression]) -> Multiple | None:
        """Return the multiple that a word between zeros is."""
        inner, shift = [*parts], 0
        while inner and isinstance(inner[-1], Number) and not inner[-1].value:
            shift += self._netlist.width(inner.pop())
        while len(inner) > 1 and self._extends(inner[0], inner[1]):
            inner.pop(0)
        multiple = self._multiple(inner[0]) if len(inner) == 1 else None
        return None if multiple is None else Multiple(multiple.word, multiple.factor << shift)

    def _extends(self, upper: Expression, lower: Expression) -> bool:
        """Whether bits above others are zeros, or repeat the sign."""
        if isinstance(upper, Number):
            return not upper.value
        if not isinstance(upper, Bits) or not isinstance(lower, Bits) or self._netlist.width(upper) != 1:
            return False
        top = lower.low + self._netlist.width(lower) - 1
        return (upper.name, upper.low) == (lower.name, top)

    def _followed(self, value: Bits) -> Multiple:
        """Follow bits of a net back to where they are computed."""
        word = Bits(value.name, value.low, self._netlist.width(value))
        if word not in self._multiples:
            if word in self._open:
                return Multiple(word, 1)
            self._open.add(word)
            source = self._source(word)
            multiple = None if source is None else self._multiple(source)
            self._open.discard(word)
            self._multiples[word] = multiple or Multiple(word, 1)
        return self._multiples[word]

    def _source(self, word: Bits) -> Expression | None:
        """Return what bits of a net are; None if they are those of a register, or more than one thing."""
        netlist, width = self._netlist, word.width
        assert width is not None
        for driver in netlist.drivers.get(word.name, ()):
            start = word.low - driver.low
            if start >= 0 and start + width <= driver.width:
                if isinstance(driver.value, Operator):
                    return driver.value if not start + driver.start else None
                return sliced(netlist, driver.value, start + driver.start, width, followed=0)
        return None


def _constant(value: Expression) -> int | None:
    """Return a constant operand, with its sign."""
    inside = value.operands[0] if isinstance(value, Operator) and value.symbol == "signed" else value
    if not isinstance(inside, Number):
        return None
    negative = is_signed(value) and inside.value >> (inside.width - 1)
    return inside.value - (1 << inside.width) if negative else inside.value


def _split(factor: int) -> tuple[int, int]:
    """Return the odd factor of a number, and how far it is shifted to the left."""
    return _odd(factor), (factor & -factor).bit_length() - 1


def _loads(statements: Sequence[Statement]) -> list[Expression]:
    values: list[Expression] = []
    for statement in statements:
        if isinstance(statement, Load):
            values.append(statement.value)
        elif isinstance(statement, Choice):
            values += [*_loads(statement.yes), *_loads(statement.no)]
    return values
