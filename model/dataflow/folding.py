"""Folds a datapath into a program for one multiply-accumulate unit, which folded and serial hardware run.

::

    graphs of the stages       stored values           sums               columns            instructions
    +------------------+   +-----------------+   +---------------+   +-----------------+   +---------------+
    | x, y1, *, +,     |-->| ports, states,  |-->| multiples of  |-->| products digit  |-->| MULTIPLY ..   |
    | floor, ..        |   | what is cut or  |   | stored digits |   | by digit, by    |   | DROP or STORE |
    |                  |   | multiplied      |   | and a constant|   | their weight    |   | .. FINISH     |
    +------------------+   +-----------------+   +---------------+   +-----------------+   +---------------+

- A value is stored if it is a port or a state, or if it is cut, delayed or multiplied as a whole. It gets just enough
  fraction bits to bring a quantizer's cut between two of its digits: ``floor(v)`` is then the upper digits of v, and
  what it drops the lower ones, at no cost.
- A sum is computed column by column, the lowest first. When a column is complete, its low digit is stored and the rest
  is carried on by a shift. To drop the digit instead is the floor that the datapath asks for, so nothing is
  approximate.
- Values that are not needed at the same time share words (`sosmith.model.dataflow.word_reuse`).

The program is made from the graphs alone and computes the same codes.

As an example, ``y(n) = floor(3 / 4 y(n-1) + 4 x(n))`` with digits of 4 bits. x takes one digit, y and its state y1 two:

>>> from types import SimpleNamespace
>>> from sosmith.model.dataflow.graph import GraphBuilder
>>> from sosmith.model.port import Port
>>> g = GraphBuilder()
>>> x = g.input("x", frac=0, low=-8, high=7)
>>> y1 = g.delay("y1", frac=0, low=-128, high=127)
>>> y = g.floor(g.add(g.shift(x, 2), g.scale(y1, 3, frac=2)), frac=0, name="y")
>>> g.connect(y1, y)
>>> section = SimpleNamespace(name="section", graph=g.build([y]))
>>> ports = [Port.from_range(name, bits, Fraction(-1), Fraction(1), signed=True) for name, bits in (("x", 4), ("y", 8))]
>>> datapath = Datapath(name="example", inputs=(ports[0],), output=ports[1], stages=(section,))
>>> made = program(datapath, digit_bits=4)
>>> [(at.name, at.address, at.digits) for at in made.locations]
[('section.y1', 0, 2), ('section.x', 2, 1), ('section.y', 2, 2)]

3 / 4 is 12 / 16: the products of y1 begin one column below y, which is dropped. 4 is 64 / 16, whose digits are 0 and 4:
the product of x begins in the column of y's low digit. x is dead once it has been multiplied, so y takes its word:

>>> for number, (opcode, address, constant) in enumerate(made.instructions):
...     print(f"{number:2}  {opcode.mnemonic:8} {address}  {constant:2}")
 0  take     2   0
 1  multiply 0  12
 2  drop     0   0
 3  nothing  0   0
 4  multiply 2   4
 5  multiply 1  12
 6  store    2   0
 7  finish   3   0
 8  nothing  0   0
 9  nothing  0   0
10  multiply 2   1
11  store    0   0
12  multiply 3   1
13  finish   1   0
14  give     2   0
15  give     3   1

The instructions 10 to 13 copy y to its state; a NOTHING keeps one that reads a word far enough from the one that stores
it. Three samples, by the program and by the graph:

>>> words = made.reset()
>>> [made.step([code], words, [0]).code for code in (7, 7, -8)]
[28, 49, 4]
>>> datapath.compute_exact([[7], [7], [-8]])
[28, 49, 4]
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Node, Op
from sosmith.model.dataflow.program import HAZARD, Instruction, Location, Opcode, Program, digits_of
from sosmith.model.dataflow.word_reuse import LiveRange, WordBlock, packed


class FoldingError(ValueError):
    """The datapath cannot be computed by one multiply-accumulate unit."""


def program(datapath: Datapath, digit_bits: int, *, like: Program | None = None) -> Program:
    """Fold a datapath.

    Parameters
    ----------
    datapath : Datapath
        What is to be computed.
    digit_bits : int
        Bits of a digit: one less than those of a factor of the multiplier.
    like : Program or None
        A program that the new one must be able to take over from at any sample, in the same hardware and with its
        states: a location gets at least as many digits as the one of the same name.

    Raises
    ------
    FoldingError
        If the datapath has an operation that cannot be folded, or the new program cannot take over from `like`.
    """
    kept = {} if like is None else {location.name: location.digits for location in like.locations}
    least = 0 if like is None else like.words
    made = _Folding(_flattened(datapath), digit_bits, kept, datapath.calibrated).program(least)
    if like is None:
        return made
    _check_can_take_over(made, like)
    return replace(made, accumulator_bits=like.accumulator_bits)


def _check_can_take_over(made: Program, like: Program) -> None:
    """Check that states and ports are stored alike, and that the rest fits the hardware.

    Raises
    ------
    FoldingError
        If one of them does not.
    """
    for what, new, old in (
        ("digit_bits", made.digit_bits, like.digit_bits),
        ("its states", _states(made), _states(like)),
        ("digits and fraction bits of its inputs", _forms(made.inputs), _forms(like.inputs)),
        ("digits and fraction bits of its output", _forms([made.output]), _forms([like.output])),
    ):
        if new != old:
            raise FoldingError(f"to take over, {what} must be {old}, not {new}")
    for what, new, old in (
        ("words of memory", made.words, like.words),
        ("bits of the accumulator", made.accumulator_bits, like.accumulator_bits),
    ):
        if new > old:
            raise FoldingError(f"to take over, {what} must be at most {old}, not {new}")


def _states(made: Program) -> list[tuple[str, int, int, int]]:
    return [(at.name, at.address, at.digits, at.frac) for at in made.locations if at.is_state]


def _forms(locations: Sequence[Location]) -> list[tuple[int, int]]:
    return [(location.digits, location.frac) for location in locations]


class _Flat(NamedTuple):
    """All stages' nodes in one list; `inputs` and `output` index it."""

    nodes: list[Node]
    inputs: list[int]
    output: int


def _flattened(datapath: Datapath) -> _Flat:
    """Join the stages' graphs: the inputs of each become the outputs of the one before."""
    nodes: list[Node] = []
    inputs: list[int] = []
    passed: list[int] = []
    for stage in datapath.stages:
        graph = stage.graph
        supply = iter(passed)
        at: list[int] = []
        start = len(nodes)
        for node in graph.nodes:
            if node.op is Op.INPUT and passed:
                at.append(next(supply))
                continue
            at.append(len(nodes))
            name = f"{stage.name}.{node.name}" if node.name else ""
            nodes.append(Node(**{**vars(node), "name": name}))
            if node.op is Op.INPUT:
                inputs.append(len(nodes) - 1)
        for index in range(start, len(nodes)):
            node = nodes[index]
            nodes[index] = Node(**{**vars(node), "operands": tuple(at[i] for i in node.operands)})
        passed = [at[i] for i in graph.outputs]
    (output,) = passed
    return _Flat(nodes, inputs, output)


class _Term(NamedTuple):
    """Digits of a stored value: `length` of them from `first` on; times the stored value `other`, unless that is -1."""

    value: int
    first: int
    length: int
    other: int = -1


_Sum = dict[_Term, Fraction]
"""Multiples of stored digits, each read as a number with the fraction bits of its lowest digit."""


class _Folding:
    """Decides which values to store, where, and in which order to compute them."""

    def __init__(
        self, flat: _Flat, digit_bits: int, kept: Mapping[str, int], calibrated: Sequence[tuple[int, int]]
    ) -> None:
        self._nodes, self._inputs, self._output = flat
        self._calibrated = calibrated
        self._bits = digit_bits
        self._kept = kept
        last = self._nodes[self._output]
        if last.op is Op.CLAMP:  # done on the way out
            self._nodes.remove(last)
            self._output = last.operands[0]
        self._stored = self._find_stored()
        self._fracs = self._find_fracs()
        while apart := self._cut_elsewhere():
            self._stored |= apart
            self._fracs = self._find_fracs()
        self._sums: dict[int, tuple[_Sum, Fraction]] = {}
        self._locations: dict[int, Location] = {}
        self._instructions: list[Instruction] = []
        self._schedule: list[tuple[str, int, int]] = []
        self._one = 0

    def program(self, least_words: int) -> Program:
        """Make the program for a memory of at least `least_words` words.

        At first every value has words of its own, and the word that always holds 1 follows the states.
        """
        address = states = 0
        for index in sorted(self._stored, key=lambda i: self._nodes[i].op is not Op.DELAY):
            node = self._nodes[index]
            if node.op is not Op.DELAY and address == states:
                address += 1  # the word that always holds 1
            count = self._digits(
                node.low << (self._fracs[index] - node.frac), node.high << (self._fracs[index] - node.frac)
            )
            state, name = node.op is Op.DELAY, node.name or f"value{index}"
            count = max(count, self._kept.get(name, 0))
            self._locations[index] = Location(name, address, count, self._fracs[index], state)
            address += count
            states += count * state
        self._one = states
        self._emit_all()
        accumulator_bits = self._accumulator_bits()
        words = self._share_words(states, least_words)
        return Program(
            digit_bits=self._bits,
            instructions=tuple(self._instructions),
            locations=tuple(self._locations.values()),
            inputs=tuple(self._locations[i] for i in self._inputs),
            output=self._locations[self._output],
            states=states,
            words=words,
            schedule=tuple(self._schedule),
            accumulator_bits=accumulator_bits,
        )

    def _emit_all(self) -> None:
        locations = [self._locations[index] for index in self._inputs]
        for k, digit in enumerate(location.address + k for location in locations for k in range(location.digits)):
            self._emit(Opcode.TAKE, digit, k)
        self._scheduled("input")
        for index, ends in zip(self._inputs, self._calibrated, strict=True):
            self._judge(index, *ends)
        self._scheduled("range")
        for index in self._in_order():
            self._evaluate(self._locations[index], *self._sum(index))
            self._scheduled(self._locations[index].name)
        output = self._locations[self._output]
        for k in range(output.digits):
            self._emit(Opcode.GIVE, output.address + k, k)
        self._scheduled("output")

    def _scheduled(self, name: str) -> None:
        """Note that the instructions since the last note compute `name`."""
        start = sum(self._schedule[-1][1:]) if self._schedule else 0
        count = len(self._instructions) - start
        if count:
            self._schedule.append((name, start, count))

    def _share_words(self, states: int, least: int) -> int:
        """Let values share words where their live ranges allow it; return the number of words, a power of two."""
        uses: dict[int, list[int]] = {}
        for number, (opcode, address, _) in enumerate(self._instructions):
            if opcode not in {Opcode.NOTHING, Opcode.DROP, Opcode.JUDGE}:
                uses.setdefault(address, []).append(number)
        values = []
        for location in self._locations.values():
            if not location.is_state:
                found = sorted(number for k in range(location.digits) for number in uses.get(location.address + k, ()))
                values.append((WordBlock(location.address, location.digits), LiveRange(found[0], found[-1])))
        given, end = packed(values, states)
        words = max(1 << end.bit_length(), least)
        moved = {self._one: words - 1} | {
            block.address + k: address + k for block, address in given.items() for k in range(block.words)
        }
        self._instructions = [i._replace(address=moved.get(i.address, i.address)) for i in self._instructions]
        self._locations = {
            index: replace(location, address=moved.get(location.address, location.address))
            for index, location in self._locations.items()
        }
        return words

    # What is stored.

    def _find_stored(self) -> set[int]:
        """Return the nodes to store: ports, states, and whatever is cut, delayed or multiplied as a whole."""
        stored = {*self._inputs, self._output}
        for index, node in enumerate(self._nodes):
            first = node.operands[0] if node.operands else -1
            if node.op is Op.DELAY:
                is_cut = self._nodes[first].op in {Op.FLOOR, Op.FRACTION}
                stored |= {index} if is_cut else {index, first}
            elif node.op is Op.FRACTION:
                stored.add(first)
            elif node.op is Op.MULTIPLY:
                stored |= {i for i in node.operands if self._nodes[i].op is not Op.CONSTANT}
            elif node.op is Op.SCALE and self._nodes[first].op in {Op.ADD, Op.SUBTRACT, Op.SHIFT, Op.BOUND}:
                stored.add(first)
            elif node.op in {Op.CLAMP, Op.TRUNCATE}:
                raise FoldingError(f"the datapath must not {node.op.value} inside to be folded")
        for index, node in enumerate(self._nodes):
            if node.op is Op.FLOOR and node.operands[0] not in stored:
                stored.add(index)
        return {i for i in stored if self._nodes[i].op is not Op.CONSTANT}

    def _cut_elsewhere(self) -> set[int]:
        """Return the FLOOR nodes whose cut is not between two digits of the stored value; they are stored too."""
        return {
            index
            for index, node in enumerate(self._nodes)
            if node.op is Op.FLOOR
            and index not in self._stored
            and (self._fracs[node.operands[0]] - node.frac) % self._bits
        }

    def _find_fracs(self) -> dict[int, int]:
        """Return the fraction bits of each stored code: at least its node's, with its first cut between two digits."""
        group = {index: index for index in self._stored}
        for index in self._stored:
            node = self._nodes[index]
            if node.op is Op.DELAY:
                group[index] = self._first_source(index)
        cuts: dict[int, int] = {}
        for node in self._nodes:
            if node.op in {Op.FLOOR, Op.FRACTION}:
                operand = node.operands[0]
                if operand in self._stored:
                    cuts.setdefault(group[operand], node.parameter if node.op is Op.FRACTION else node.frac)
            elif node.op is Op.MULTIPLY and all(self._nodes[i].op is not Op.CONSTANT for i in node.operands):
                cuts.setdefault(group[node.operands[1]], 0)
        fracs = {}
        for index in self._stored:
            frac = max(self._nodes[i].frac for i in self._stored if group[i] == group[index])
            cut = cuts.get(group[index], frac)
            fracs[index] = cut + self._bits * -(-(frac - cut) // self._bits)
        return fracs

    def _first_source(self, index: int) -> int:
        """Follow a chain of delays to what it begins with."""
        while self._nodes[index].op is Op.DELAY:
            index = self._nodes[index].operands[0]
        return index

    def _digits(self, low: int, high: int) -> int:
        """Return the number of digits that hold the range."""
        count = 1
        while not (-(1 << (self._bits * count)) <= low and high < 1 << (self._bits * count)):
            count += 1
        return count

    # What values are made of.

    def _value(self, index: int) -> tuple[_Sum, Fraction]:
        """Return a node as a sum of stored digits and a constant."""
        if index in self._locations:
            return {_Term(index, 0, self._locations[index].digits): Fraction(1)}, Fraction(0)
        if index not in self._sums:
            self._sums[index] = self._definition(index)
        return self._sums[index]

    def _definition(self, index: int) -> tuple[_Sum, Fraction]:
        """Return a node as a sum of stored digits and a constant, from its operands."""
        node = self._nodes[index]
        if node.op is Op.CONSTANT:
            return {}, node.parameter * Fraction(2) ** -node.frac
        if node.op in {Op.ADD, Op.SUBTRACT}:
            sign = 1 if node.op is Op.ADD else -1
            (a, constant_a), (b, constant_b) = map(self._value, node.operands)
            total = dict(a)
            for term, weight in b.items():
                total[term] = total.get(term, Fraction(0)) + sign * weight
            return {term: weight for term, weight in total.items() if weight}, constant_a + sign * constant_b
        if node.op in {Op.SHIFT, Op.SCALE}:
            scales = node.op is Op.SCALE
            factor = node.parameter * Fraction(2) ** -node.parameter_frac if scales else Fraction(2) ** node.parameter
            total, constant = self._value(node.operands[0])
            return {term: weight * factor for term, weight in total.items()}, constant * factor
        if node.op is Op.BOUND:
            return self._value(node.operands[0])
        if node.op is Op.MULTIPLY:
            return self._product(*node.operands)
        if node.op in {Op.FLOOR, Op.FRACTION}:
            return self._cut(node)
        raise FoldingError(f"the datapath must not {node.op.value} inside to be folded")

    def _product(self, a: int, b: int) -> tuple[_Sum, Fraction]:
        """Return the product of two nodes, one of which may be a constant."""
        for one, other in ((a, b), (b, a)):
            if self._nodes[one].op is Op.CONSTANT:
                _, factor = self._value(one)
                total, constant = self._value(other)
                return {term: weight * factor for term, weight in total.items()}, constant * factor
        first, second = self._locations[a], b
        return {_Term(a, 0, first.digits, second): Fraction(1)}, Fraction(0)

    def _cut(self, node: Node) -> tuple[_Sum, Fraction]:
        """Return the upper or the lower digits of a stored value."""
        root = node.operands[0]
        if root not in self._locations:
            raise FoldingError(f"{node.name!r} must cut a stored value to be folded")
        location = self._locations[root]
        kept = node.parameter if node.op is Op.FRACTION else node.frac
        lower, rest = divmod(location.frac - kept, self._bits)
        if rest:
            raise FoldingError(f"{node.name!r} must cut its value where another quantizer does to be folded")
        if node.op is Op.FRACTION:
            return ({_Term(root, 0, lower): Fraction(1)} if lower else {}), Fraction(0)
        if lower >= location.digits:
            raise FoldingError(f"{node.name!r} must leave a digit to be folded")
        return {_Term(root, lower, location.digits - lower): Fraction(1)}, Fraction(0)

    # How they are computed.

    def _judge(self, index: int, low: int, high: int) -> None:
        """Compare an input with each end of its calibrated range that is not an end of its codes, by a subtraction."""
        node, location = self._nodes[index], self._locations[index]
        ends = [(low, 1)] * (low > node.low) + [(high, -1)] * (high < node.high)
        for end, sign in ends:
            for k, digit in enumerate(digits_of(end << (location.frac - node.frac), location.digits, self._bits)):
                self._emit(Opcode.MULTIPLY, location.address + k, sign)
                self._emit(Opcode.MULTIPLY, self._one, -sign * digit)
                self._emit(*((Opcode.JUDGE,) if k == location.digits - 1 else (Opcode.DROP,)))

    def _sum(self, index: int) -> tuple[_Sum, Fraction]:
        """Return a stored value in terms of other stored values."""
        node = self._nodes[index]
        return self._value(node.operands[0]) if node.op in {Op.FLOOR, Op.DELAY} else self._definition(index)

    def _in_order(self) -> Iterator[int]:
        """Yield values in the order of the datapath, and each state as soon as nothing needs its old value any more.

        The sooner that is, the shorter the live range of the value that the state is copied from.
        """
        read = {
            i: {value for term in self._sum(i)[0] for value in (term.value, term.other)}
            for i in self._stored
            if self._nodes[i].op is not Op.INPUT
        }
        values = [i for i in sorted(read) if self._nodes[i].op is not Op.DELAY]
        delays = [i for i in sorted(read) if self._nodes[i].op is Op.DELAY]
        while values or delays:
            waiting = set(values)
            free = [
                d
                for d in delays
                if not read[d] & waiting and not any(d in read[i] for i in (*values, *delays) if i != d)
            ]
            if free:
                delays.remove(free[0])
                yield free[0]
            else:
                yield values.pop(0)

    def _evaluate(self, location: Location, total: _Sum, constant: Fraction) -> None:
        """Emit the columns of a sum, the lowest first; drop those below the lowest digit of `location`."""
        terms: list[tuple[_Term, int, Fraction]] = []
        for term, weight in total.items():
            stored = self._locations[term.value]
            frac = stored.frac - self._bits * term.first
            if term.other >= 0:
                frac += self._locations[term.other].frac
            terms.append((term, frac, weight))
        exact = max([frac + _fraction_bits(weight) for _, frac, weight in terms] + [_fraction_bits(constant)])
        below = max(0, -(-(exact - location.frac) // self._bits))
        unit = Fraction(2) ** (location.frac + self._bits * below)
        columns: list[list[Instruction]] = [[] for _ in range(below + location.digits)]
        for term, frac, weight in terms:
            factor = weight * unit / Fraction(2) ** frac
            for instructions, column in self._products(term, int(factor)):
                self._add_to_column(instructions, column, columns)
        for column, digit in enumerate(self._constant_digits(int(constant * unit))):
            self._add_to_column([Instruction(Opcode.MULTIPLY, self._one, digit)], column, columns)
        for column, instructions in enumerate(columns):
            for instruction in instructions:
                self._emit(*instruction)
            if column < below:
                self._emit(Opcode.DROP)
            elif column < len(columns) - 1:
                self._emit(Opcode.STORE, location.address + column - below)
            else:
                self._emit(Opcode.FINISH, location.address + column - below)

    def _add_to_column(self, instructions: list[Instruction], column: int, columns: list[list[Instruction]]) -> None:
        """Add instructions to a column.

        The value is known to fit its location, and FINISH keeps ``digit_bits + 1`` bits of the top column. So of a
        product one column above that, only the lowest bit counts, and nothing of those farther up.
        """
        if column < len(columns):
            columns[column] += instructions
        elif column == len(columns):
            (instruction,) = instructions
            if instruction.opcode is not Opcode.MULTIPLY:
                raise FoldingError("a product of two values must end below its sum's top digit to be folded")
            if instruction.constant % 2:
                columns[-1].append(instruction._replace(constant=-1 << self._bits))

    def _products(self, term: _Term, factor: int) -> Iterator[tuple[list[Instruction], int]]:
        """Yield the instructions of a term times a constant, product by product, and the column of each."""
        start = self._locations[term.value].address + term.first
        if term.other < 0:
            for j, digit in enumerate(self._constant_digits(factor)):
                if not digit:
                    continue
                for i in range(term.length):
                    yield [Instruction(Opcode.MULTIPLY, start + i, digit)], i + j
            return
        shift = factor.bit_length() - 1
        if factor != 1 << shift or shift % self._bits:
            raise FoldingError("a product of two values must fall on a digit to be folded")
        other = self._locations[term.other]
        for i in range(term.length):
            for j in range(other.digits):
                pair = [Instruction(Opcode.OPERAND, start + i), Instruction(Opcode.PRODUCT, other.address + j)]
                yield pair, i + j + shift // self._bits

    def _constant_digits(self, value: int) -> list[int]:
        """Return the digits of a constant: just one if it fits, otherwise balanced about zero."""
        base, half = 1 << self._bits, 1 << (self._bits - 1)
        digits = []
        while value:
            if -base <= value < base:
                digits.append(value)
                break
            digit = (value + half) % base - half
            digits.append(digit)
            value = (value - digit) >> self._bits
        return digits

    def _emit(self, opcode: Opcode, address: int = 0, constant: int = 0) -> None:
        """Append an instruction, and before it NOTHING until it is far enough from the one that stores its word."""
        if opcode in {Opcode.MULTIPLY, Opcode.OPERAND, Opcode.PRODUCT, Opcode.GIVE}:
            for distance, earlier in enumerate(reversed(self._instructions[-HAZARD + 1 :]), start=1):
                if earlier.opcode in {Opcode.TAKE, Opcode.STORE, Opcode.FINISH} and earlier.address == address:
                    self._instructions += [Instruction(Opcode.NOTHING)] * (HAZARD - distance)
                    break
        self._instructions.append(Instruction(opcode, address, constant))

    def _accumulator_bits(self) -> int:
        """Return the width, by interval arithmetic with any values of the digits; at least that of a word."""
        base = 1 << self._bits
        tops = {p.address + p.digits - 1: self._top_range(i, p) for i, p in self._locations.items()}
        tops[self._one] = (1, 1)
        low = high = least = most = 0
        operand = (0, 0)
        for opcode, address, constant in self._instructions:
            word = tops.get(address, (0, base - 1))
            if opcode is Opcode.OPERAND:
                operand = word
            elif opcode in {Opcode.MULTIPLY, Opcode.PRODUCT}:
                factors = (constant, constant) if opcode is Opcode.MULTIPLY else operand
                ends = [a * b for a in word for b in factors]
                low, high = low + min(ends), high + max(ends)
            elif opcode in {Opcode.STORE, Opcode.DROP}:
                low, high = low >> self._bits, high >> self._bits
            elif opcode in {Opcode.FINISH, Opcode.JUDGE}:
                low = high = 0
            least, most = min(least, low), max(most, high)
        return max((-least - 1).bit_length(), most.bit_length(), self._bits) + 1

    def _top_range(self, index: int, location: Location) -> tuple[int, int]:
        """Return the range of a value's top digit."""
        node = self._nodes[index]
        shift = location.frac - node.frac - self._bits * (location.digits - 1)
        low, high = (_shifted(end, shift) for end in (node.low, node.high))
        return low, high


def _shifted(code: int, shift: int) -> int:
    return code << shift if shift >= 0 else code >> -shift


def _fraction_bits(value: Fraction) -> int:
    return value.denominator.bit_length() - 1
