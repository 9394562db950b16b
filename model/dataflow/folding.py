"""Folds a datapath into a program for one multiply-accumulate unit, which folded and serial hardware run.

::

    graphs of the stages       stored values           sums               columns            instructions
    +------------------+   +-----------------+   +---------------+   +-----------------+   +---------------+
    | x, y1, *, +,     |-->| ports, states,  |-->| multiples of  |-->| products digit  |-->| MULTIPLY ..   |
    | floor, ..        |   | what is cut or  |   | stored digits |   | by digit, by    |   | DROP or STORE |
    |                  |   | multiplied      |   | and a constant|   | their weight    |   | .. FINISH     |
    +------------------+   +-----------------+   +---------------+   +-----------------+   +---------------+
                                                                                   sosmith.model.dataflow.scheduling

- A value is stored if it is a port or a state, or if it is cut, delayed or multiplied as a whole. It gets just enough
  fraction bits to bring a quantizer's cut between two of its digits: ``floor(v)`` is then the upper digits of v, and
  what it drops the lower ones, at no cost.
- A sum is computed column by column, the lowest first. The last product of a column ends it: its low digit is stored
  and the rest is carried on by a shift. To drop the digit instead is the floor that the datapath asks for, so nothing
  is approximate.
- A state that holds nothing but the floor of another state is not kept again.

The program is made from the graphs alone and computes the same codes.

As an example, ``y(n) = floor(3 / 4 y(n-1) + 4 x(n))`` with digits of 4 bits. x takes one digit, y and its state y1 two:

>>> from fractions import Fraction
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
>>> folded = program(datapath, digit_bits=4)
>>> [(at.name, at.addresses) for at in folded.locations]
[('section.y1', (0, 1)), ('section.x', (2,)), ('section.y', (0, 1))]

3 / 4 is 12 / 16: the products of y1 begin one column below y, which is dropped. 4 is 64 / 16, whose digits are 0 and 4:
the product of x begins in the column of y's low digit. Nothing needs a digit of y1 any more when one of y is stored,
which takes its word and becomes the next y1:

>>> for number, (opcode, address, constant, target, *_) in enumerate(folded.instructions):
...     print(f"{number}  {opcode.mnemonic:8} {address}  {constant:2}  {target}")
0  take     3   0  2
1  drop     0  12  0
2  multiply 1  12  0
3  store    2   4  0
4  finish   3   0  1
5  multiply 3   0  0
6  multiply 3   0  0
7  give     0   1  0
8  give     1   1  1

The instructions 5 and 6 add nothing: they keep 7 far enough from 3, which stores the word that it reads.

Three samples, by the program and by the graph:

>>> words = folded.reset()
>>> [folded.step([code], words, [0]).code for code in (7, 7, -8)]
[28, 49, 4]
>>> datapath.compute_exact([[7], [7], [-8]])
[28, 49, 4]
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext, suppress
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph, Node, Op
from sosmith.model.dataflow.program import (
    CARRIES,
    CLEARS,
    PRODUCTS,
    Judged,
    Location,
    Opcode,
    Program,
    Result,
    digits_of,
)
from sosmith.model.dataflow.scheduling import ONE, Column, Digit, Product, Scheduler, Sum

_FEW = 3
"""Products of a sum that may be computed again where it is needed early."""

_SEED = 1
"""Of the orders that are tried."""


class FoldingError(ValueError):
    """The datapath cannot be computed by one multiply-accumulate unit."""


def program(
    datapath: Datapath,
    digit_bits: int,
    *,
    spare_words: int = 0,
    like: Program | None = None,
    products: int = 1,
    trials: int = 0,
) -> Program:
    """Fold a datapath.

    Parameters
    ----------
    datapath : Datapath
        What is to be computed.
    digit_bits : int
        Bits of a digit: one less than those of a factor of the multiplier.
    spare_words : int
        Words of memory beyond those that it needs.
    like : Program or None
        A program that the new one must be able to take over from at any sample, in the same hardware and with its
        states: a location gets at least as many digits as the one of the same name.
    products : int
        Products at each clock, 1 or 2.
    trials : int
        Other orders of the sums that are tried for a shorter program; the same ones in every run.

    Raises
    ------
    FoldingError
        If the datapath has an operation that cannot be folded, or the new program cannot take over from `like`.
    """
    kept = {} if like is None else {location.name: location.digits for location in like.locations}
    least = 0 if like is None else like.words
    flat = _flattened(datapath)
    _share_delays(flat.nodes)
    folding = _Folding(flat, digit_bits, kept, datapath.calibrated)
    foldings = [folding, *(folding.repeating(index) for index in (folding.repeats() if products > 1 else ()))]
    made = [(one, folded) for one in foldings for folded in one.programs(least, spare_words, products)]
    shorter = [one.shorter(folded, least, spare_words, trials // len(made)) for one, folded in made]
    folded = min(shorter, key=lambda one: (len(one.instructions), one.words))
    if like is None:
        return folded
    _check_can_take_over(folded, like)
    return replace(folded, accumulator_bits=like.accumulator_bits)


def columns_of(graph: Graph, digit_bits: int) -> list[Column]:
    """Return the columns that compute one stage's values, for an estimate of what it adds to a program.

    A program has an instruction for each product, and one for each column without products; besides those that take
    samples, move operands or states, and wait. An output that is the floor of a value costs nothing.

    Raises
    ------
    FoldingError
        If the stage has an operation that cannot be folded.
    """
    nodes = list(graph.nodes)
    _share_delays(nodes)
    output = graph.outputs[0]
    if nodes[output].op is Op.FLOOR:
        (output,) = nodes[output].operands
    return _Folding(_Flat(nodes, list(graph.inputs), output), digit_bits, {}, ()).columns()


def _check_can_take_over(new_program: Program, like: Program) -> None:
    """Check that states and ports are stored alike, and that the rest fits the hardware.

    Raises
    ------
    FoldingError
        If one of them does not.
    """
    for what, new, old in (
        ("digit_bits", new_program.digit_bits, like.digit_bits),
        ("its states", _states(new_program), _states(like)),
        ("digits and fraction bits of its inputs", _forms(new_program.inputs), _forms(like.inputs)),
        ("fraction bits and parts of its output", new_program.output[1:], like.output[1:]),
    ):
        if new != old:
            raise FoldingError(f"to take over, {what} must be {old}, not {new}")
    for what, new, old in (
        ("words of memory", new_program.words, like.words),
        ("bits of the accumulator", new_program.accumulator_bits, like.accumulator_bits),
    ):
        if new > old:
            raise FoldingError(f"to take over, {what} must be at most {old}, not {new}")


def _states(of: Program) -> list[tuple[str, tuple[int, ...], int]]:
    return [(at.name, at.addresses, at.frac) for at in of.locations if at.is_state]


def _forms(locations: Sequence[Location]) -> list[tuple[int, int]]:
    return [(location.digits, location.frac) for location in locations]


class _Flat(NamedTuple):
    """All stages' nodes in one list, which the rest indexes; `settling` is None without that flag."""

    nodes: list[Node]
    inputs: list[int]
    output: int
    settling: int | None = None


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
            nodes.append(node._replace(name=name))
            if node.op is Op.INPUT:
                inputs.append(len(nodes) - 1)
        for index in range(start, len(nodes)):
            node = nodes[index]
            nodes[index] = node._replace(operands=tuple(at[i] for i in node.operands))
        passed = [at[i] for i in graph.outputs]
    return _Flat(nodes, inputs, *passed)


def _share_delays(nodes: list[Node]) -> None:
    """Let a delay of what another delay holds anyway read that one, instead of keeping it once more.

    A section keeps y(n-1) with all its fraction bits, and the next one x(n-1), which is the floor of that.
    """
    changed = True
    while changed:
        changed = False
        kept: dict[int, int] = {}
        for index, node in enumerate(nodes):
            if node.op is Op.DELAY:
                kept.setdefault(node.operands[0], index)
        for index, node in enumerate(nodes):
            if node.op is not Op.DELAY:
                continue
            source = node.operands[0]
            of = nodes[source]
            if kept[source] != index:
                nodes[index] = node._replace(op=Op.BOUND, operands=(kept[source],))
                for other, user in enumerate(nodes):
                    moved = tuple(kept[source] if i == index else i for i in user.operands)
                    nodes[other] = user._replace(operands=moved)
            elif of.op is Op.FLOOR and of.operands[0] in kept:
                nodes[index] = node._replace(op=Op.FLOOR, operands=(kept[of.operands[0]],))
            else:
                continue
            changed = True
            break


class _Term(NamedTuple):
    """Digits of a stored value: `length` of them from `first` on; times the stored value `other`, unless that is -1."""

    value: int
    first: int
    length: int
    other: int = -1


class _Form(NamedTuple):
    """How a value is stored: number of digits, and fraction bits of the code that they make."""

    digits: int
    frac: int


class _Total(NamedTuple):
    """Multiples of stored digits and a constant: integers that are all multiples of ``2**-frac``.

    Digits are read as a number with the fraction bits of the lowest one.
    """

    weights: dict[_Term, int]
    constant: int
    frac: int

    def times(self, factor: int, frac: int) -> _Total:
        """Return the product with ``factor * 2**-frac``."""
        weights = {term: weight * factor for term, weight in self.weights.items()}
        return _Total(weights, self.constant * factor, self.frac + frac)


class _Folding:
    """Decides which values to store, and makes the sums that compute them."""

    def __init__(
        self,
        flat: _Flat,
        digit_bits: int,
        kept: Mapping[str, int],
        calibrated: Sequence[tuple[int, int]],
    ) -> None:
        self._nodes, self._inputs, self._output, self._settling = flat
        self._calibrated = calibrated
        self._bits = digit_bits
        last = self._nodes[self._output]
        if last.op is Op.CLAMP:  # done on the way out
            self._nodes.remove(last)
            self._output = last.operands[0]
        self._stored = self._find_stored()
        self._fracs = self._find_fracs()
        while apart := self._cut_elsewhere():
            self._stored |= apart
            self._fracs = self._find_fracs()
        self._totals: dict[int, _Total] = {}
        self._order: list[int] = []
        self._forms = {index: self._form(index, kept) for index in sorted(self._stored)}
        self._repeated: frozenset[int] = frozenset()
        self._repeats = -1

    def _form(self, index: int, kept: Mapping[str, int]) -> _Form:
        node, frac = self._nodes[index], self._fracs[index]
        count = self._digits(_shifted(node.low, frac - node.frac), _shifted(node.high, frac - node.frac))
        return _Form(max(count, kept.get(self._name(index), 0)), frac)

    def _name(self, index: int) -> str:
        return self._nodes[index].name or f"value{index}"

    def repeats(self) -> list[int]:
        """Return the stored values whose sums may repeat those of others that they need, see `_repeatable`."""
        repeated = {*self._repeatable()}
        return [
            index
            for index in sorted(self._stored - {*self._inputs, *self._delays()})
            if repeated.intersection(term.value for term in self._sum(index).weights)
        ]

    def repeating(self, index: int) -> _Folding:
        """Return the same but that the sum of a stored value repeats others, see `_repeatable`."""
        other = copy(self)
        other.__dict__.pop("_sums", None)
        other._repeats = index
        return other

    def programs(self, least_words: int, spare_words: int, products: int) -> Iterator[Program]:
        """Make the program, if there is one; without sums that repeat others, there must be."""
        with nullcontext() if self._repeats < 0 else suppress(FoldingError):
            yield self.program(least_words, spare_words, products)

    def shorter(self, folded: Program, least_words: int, spare_words: int, trials: int) -> Program:
        """Return the shortest of some programs: each with one sum elsewhere in the order of the shortest one so far."""
        rng = random.Random(_SEED)
        order, ways = list(self._order), (True, False)
        for trial in range(trials):
            kept = list(order)
            if trial:
                kept.insert(rng.randrange(len(order)), kept.pop(rng.randrange(len(order))))
            for makes_way in ways:
                other = self.program(least_words, spare_words, folded.products, kept, makes_way=makes_way)
                if (len(other.instructions), other.words) <= (len(folded.instructions), folded.words):
                    folded, order = other, list(self._order)
        return folded

    def program(
        self,
        least_words: int,
        spare_words: int,
        products: int,
        order: Sequence[int] | None = None,
        *,
        makes_way: bool = True,
    ) -> Program:
        """Make the program for a memory of at least `least_words` words, and with some that are not used.

        Sums come in the given order, as far as they can; without one, in that of the datapath.
        """
        states: dict[Digit, int] = {}
        for index in self._delays():
            states |= {Digit(index, k): len(states) + k for k in range(self._forms[index].digits)}
        copies = dict[Digit, list[Digit]]()
        for index in self._delays():
            for source, digit in self._copied(index):
                copies.setdefault(source, []).append(digit)
        computed = dict(self._sums)
        judged = [*self._judged()]
        settling = [] if self._settling is None else [self._flagged(self._settling)]
        result = self._result(computed, copies)
        scheduler = Scheduler(states, copies, [*judged, *computed.values(), *settling, result], products, makes_way)
        scheduler.take(Digit(index, k) for index in self._inputs for k in range(self._forms[index].digits))
        for one in judged:
            scheduler.compute(one)
        scheduler.note("range")
        self._schedule(scheduler, computed, order)
        for one in settling:
            scheduler.compute(one)
        scheduler.note("settling")
        scheduler.finish(result)
        words = max(1 << (scheduler.words + spare_words).bit_length(), least_words)
        where = {digit: address % words for digit, address in scheduler.where.items()}  # that of ONE was -1
        locations = {
            index: Location(
                self._name(index),
                tuple(where[Digit(index, k)] for k in range(form.digits)),
                form.frac,
                self._nodes[index].op is Op.DELAY,
            )
            for index, form in sorted(self._forms.items(), key=lambda item: self._nodes[item[0]].op is not Op.DELAY)
            if Digit(index, 0) in where
        }
        folded = Program(
            digit_bits=self._bits,
            instructions=tuple(
                i._replace(address=i.address % words, second_address=i.second_address % words)
                for i in scheduler.instructions
            ),
            locations=tuple(locations.values()),
            inputs=tuple(locations[i] for i in self._inputs),
            output=Result(
                result.name, self._fracs[self._output], sum(column.end is Opcode.GIVE for column in result.columns)
            ),
            states=len(states),
            words=words,
            schedule=tuple(scheduler.schedule),
            accumulator_bits=self._accumulator_bits(scheduler),
            products=products,
        )
        while not folded.follows_itself:
            folded = folded.with_wait()
        return folded

    def columns(self) -> list[Column]:
        """Return the columns of all values."""
        return [column for one in self._sums.values() for column in one.columns]

    @cached_property
    def _sums(self) -> dict[int, Sum]:
        """Return the sums of all stored values but inputs, and states that take over a value as it is."""
        copied = {index for index in self._delays() if self._copied(index)}
        return {
            i: Sum(self._name(i), i, self._columns(self._sum(i), self._forms[i], i))
            for i in sorted(self._stored)
            if i not in copied and i not in self._inputs
        }

    def _delays(self) -> list[int]:
        return [index for index, node in enumerate(self._nodes) if node.op is Op.DELAY]

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
        stored = self._stored
        group = {i: self._first_source(i) if self._nodes[i].op is Op.DELAY else i for i in stored}
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
        """Follow a chain of delays to what it begins with; for the lower digits of a stored value, to that."""
        while self._nodes[index].op is Op.DELAY:
            index = self._nodes[index].operands[0]
        node = self._nodes[index]
        if node.op is Op.FRACTION and node.operands[0] in self._stored:
            return self._first_source(node.operands[0])
        return index

    def _digits(self, low: int, high: int) -> int:
        """Return the number of digits that hold the range."""
        count = 1
        while not (-(1 << (self._bits * count)) <= low and high < 1 << (self._bits * count)):
            count += 1
        return count

    # What values are made of.

    def _value(self, index: int) -> _Total:
        """Return a node as multiples of stored digits and a constant."""
        if index in self._stored and index not in self._repeated:
            return self._whole(index)
        if index not in self._totals:
            self._totals[index] = self._definition(index)
        return self._totals[index]

    def _whole(self, index: int) -> _Total:
        """Return a stored value as its own digits."""
        return _Total({_Term(index, 0, self._forms[index].digits): 1}, 0, 0)

    def _repeatable(self) -> Iterator[int]:
        """Find stored values that are sums of few digits, all of them there before the sample or taken with it.

        A sum that needs such a value may add up the same digits instead, which are there earlier.
        """
        early = {*self._inputs, *self._delays()}
        for index in sorted(self._stored - early - {self._output}):
            if self._nodes[index].op in {Op.FLOOR, Op.FRACTION}:
                continue
            terms = self._definition(index).weights
            count = sum(term.length * (self._forms[term.other].digits if term.other >= 0 else 1) for term in terms)
            if count <= _FEW and early.issuperset(of for term in terms for of in (term.value, term.other) if of >= 0):
                yield index

    def _definition(self, index: int) -> _Total:
        """Return a node as multiples of stored digits and a constant, from its operands."""
        node = self._nodes[index]
        if node.op is Op.CONSTANT:
            return _Total({}, node.parameter, node.frac)
        if node.op is Op.ADD or node.op is Op.SUBTRACT:
            sign = 1 if node.op is Op.ADD else -1
            a, b = map(self._value, node.operands)
            frac = max(a.frac, b.frac)
            up, more = frac - a.frac, sign << (frac - b.frac)
            total = {term: weight << up for term, weight in a.weights.items()}
            for term, weight in b.weights.items():
                total[term] = total.get(term, 0) + more * weight
            constant = (a.constant << up) + more * b.constant
            return _Total({term: weight for term, weight in total.items() if weight}, constant, frac)
        if node.op is Op.SHIFT:
            return self._value(node.operands[0]).times(1, -node.parameter)
        if node.op is Op.SCALE:
            return self._value(node.operands[0]).times(node.parameter, node.parameter_frac)
        if node.op is Op.BOUND:
            return self._value(node.operands[0])
        if node.op is Op.MULTIPLY:
            return self._product(*node.operands)
        if node.op in {Op.FLOOR, Op.FRACTION}:
            return self._cut(node)
        raise FoldingError(f"the datapath must not {node.op.value} inside to be folded")

    def _product(self, a: int, b: int) -> _Total:
        """Return the product of two nodes, one of which may be a constant."""
        for one, other in ((a, b), (b, a)):
            if self._nodes[one].op is Op.CONSTANT:
                return self._value(other).times(self._nodes[one].parameter, self._nodes[one].frac)
        return _Total({_Term(a, 0, self._forms[a].digits, b): 1}, 0, 0)

    def _cut(self, node: Node) -> _Total:
        """Return the upper or the lower digits of a stored value."""
        root = node.operands[0]
        if root not in self._stored:
            raise FoldingError(f"{node.name!r} must cut a stored value to be folded")
        form = self._forms[root]
        kept = node.parameter if node.op is Op.FRACTION else node.frac
        lower, rest = divmod(form.frac - kept, self._bits)
        if rest:
            raise FoldingError(f"{node.name!r} must cut its value where another quantizer does to be folded")
        if node.op is Op.FRACTION:
            return _Total({_Term(root, 0, lower): 1} if lower else {}, 0, 0)
        if lower >= form.digits:
            raise FoldingError(f"{node.name!r} must leave a digit to be folded")
        return _Total({_Term(root, lower, form.digits - lower): 1}, 0, 0)

    # How they are computed.

    def _sum(self, index: int) -> _Total:
        """Return a stored value in terms of other stored values."""
        if index != self._repeats or self._repeated:
            return self._own_sum(index)
        kept, self._totals, self._repeated = self._totals, {}, frozenset(self._repeatable())
        repeating = self._own_sum(index)
        self._totals, self._repeated = kept, frozenset()
        return repeating

    def _own_sum(self, index: int) -> _Total:
        node = self._nodes[index]
        if node.op not in {Op.FLOOR, Op.DELAY}:
            return self._definition(index)
        (source,) = node.operands
        return self._whole(source) if source in self._stored else self._value(source)

    def _copied(self, index: int) -> list[tuple[Digit, Digit]]:
        """Return the digits that a state takes over, each with its own; none if they are not just those of a value."""
        total, form = self._sum(index), self._forms[index]
        if total.constant or len(total.weights) != 1:
            return []
        ((term, weight),) = total.weights.items()
        if term.other >= 0 or weight != _shifted(1, total.frac) or (term.length, self._frac_of(term)) != form:
            return []
        return [(Digit(term.value, term.first + k), Digit(index, k)) for k in range(form.digits)]

    def _judged(self) -> Iterator[Sum]:
        """Compare an input with each end of its calibrated range that is not an end of its codes, by a subtraction."""
        for index, (low, high) in zip(self._inputs, self._calibrated, strict=True):
            node, form = self._nodes[index], self._forms[index]
            for end, sign in [(low, 1)] * (low > node.low) + [(high, -1)] * (high < node.high):
                columns = []
                for k, digit in enumerate(digits_of(end << (form.frac - node.frac), form.digits, self._bits)):
                    products = [Product(Digit(index, k), sign)] + [Product(ONE, -sign * digit)] * (digit != 0)
                    columns.append(Column(tuple(products), Opcode.JUDGE if k == form.digits - 1 else Opcode.DROP))
                yield Sum("range", -1, tuple(columns))

    def _flagged(self, index: int) -> Sum:
        """Return the sum that sets a flag if a value of one digit is negative."""
        (column,) = self._columns(self._value(index), _Form(1, 0), -1)
        return Sum("settling", -1, (column._replace(end=Opcode.JUDGE, part=Judged.SETTLING),))

    def _result(self, computed: dict[int, Sum], copies: Mapping[Digit, object]) -> Sum:
        """Return the sum that hands the result out, instead of one that stores it if nothing else needs it."""
        if self._output not in self._forms:
            raise FoldingError("the datapath must not give a constant to be folded")
        own = computed.get(self._output)
        needed = {digit.value for digit in copies}.union(
            *(one.sources for i, one in computed.items() if own is not one)
        )
        late = {i for i in computed if self._nodes[i].op is Op.DELAY}  # written before the result is computed
        if own is None or self._output in needed or own.sources & late:
            digits = range(self._forms[self._output].digits)
            products = [(Product(Digit(self._output, k), 1),) for k in digits]
            columns = [Column(product, Opcode.GIVE, part=k) for k, product in enumerate(products)]
        else:
            del computed[self._output]
            form = self._forms[self._output]._replace(digits=0)
            columns = [*self._columns(self._sum(self._output), form, -1)]
        return Sum(self._name(self._output), -1, tuple(columns))

    def _schedule(self, scheduler: Scheduler, computed: Mapping[int, Sum], order: Sequence[int] | None) -> None:
        """Compute values in the order of the datapath; while the next one would have to wait, another one if it can.

        Or each as soon as it can be computed, the first of an order before the others.

        Raises
        ------
        FoldingError
            If there is no order in which each state is read before it is written.
        """
        left = dict(computed)
        places = {} if order is None else {index: place for place, index in enumerate(order)}
        self._order = []
        while left:
            needed = {i for i in left if self._nodes[i].op is not Op.DELAY}
            free = [
                i
                for i, one in left.items()
                if not one.sources & (needed - {i}) and (i in needed or scheduler.is_unused(one))
            ]
            if not free:
                raise FoldingError(f"{next(iter(left.values())).name!r} must not be needed after it is written")
            if order is not None:
                free.sort(key=places.__getitem__)
            elif scheduler.stalls(left[free[0]]):
                free.sort(key=lambda i: scheduler.stalls(left[i]))
            self._order.append(free[0])
            one = left.pop(free[0])
            scheduler.compute(one)
            scheduler.note(one.name)

    def _columns(self, total: _Total, form: _Form, value: int) -> tuple[Column, ...]:
        """Return the columns of a sum, the lowest first: those below its lowest digit are dropped, others are stored.

        If the value is -1, they are handed out, the last of them with all that is carried on from it.
        """
        fracs = [self._frac_of(term) for term in total.weights]
        exact = max(
            [_fraction_bits(total.constant, total.frac)]
            + [
                frac + _fraction_bits(weight, total.frac)
                for frac, weight in zip(fracs, total.weights.values(), strict=True)
            ]
        )
        below = max(0, -(-(exact - form.frac) // self._bits))
        finest = form.frac + self._bits * below - total.frac
        products = [
            placed
            for frac, (term, weight) in zip(fracs, total.weights.items(), strict=True)
            for placed in self._products(term, _shifted(weight, finest - frac))
        ]
        products += [
            (Product(ONE, digit), column)
            for column, digit in enumerate(self._constant_digits(_shifted(total.constant, finest)))
            if digit
        ]
        count = form.digits if value >= 0 else max([column + 1 - below for _, column in products] + [1])
        columns: list[list[Product]] = [[] for _ in range(below + count)]
        for product, column in products:
            self._add_to_column(product, column, columns)
        finished = []
        for number, in_column in enumerate(columns):
            k = number - below
            if k < 0:
                finished.append(Column(tuple(in_column), Opcode.DROP))
            elif value < 0:
                finished.append(Column(tuple(in_column), Opcode.GIVE, part=k))
            else:
                finished.append(
                    Column(tuple(in_column), Opcode.STORE if k < count - 1 else Opcode.FINISH, Digit(value, k))
                )
        return tuple(finished)

    def _frac_of(self, term: _Term) -> int:
        """Return the fraction bits of a term: those of the lowest digit, or of its product with the other value."""
        frac = self._forms[term.value].frac - self._bits * term.first
        return frac if term.other < 0 else frac + self._forms[term.other].frac

    def _add_to_column(self, product: Product, column: int, columns: list[list[Product]]) -> None:
        """Add a product to a column.

        The value is known to fit its digits, and FINISH keeps ``digit_bits + 1`` bits of the top column. So of a
        product one column above that, only the lowest bit counts, and nothing of those farther up.
        """
        if column < len(columns):
            columns[column].append(product)
        elif column == len(columns):
            if product.other is not None:
                raise FoldingError("a product of two values must end below its sum's top digit to be folded")
            if product.constant % 2:
                columns[-1].append(product._replace(constant=-1 << self._bits))

    def _products(self, term: _Term, factor: int) -> Iterator[tuple[Product, int]]:
        """Yield the products of a term times a constant, and the column of each."""
        if term.other < 0:
            for j, digit in enumerate(self._constant_digits(factor)):
                for i in range(term.length if digit else 0):
                    yield Product(Digit(term.value, term.first + i), digit), i + j
            return
        shift = factor.bit_length() - 1
        if factor != 1 << shift or shift % self._bits:
            raise FoldingError("a product of two values must fall on a digit to be folded")
        for i in range(term.length):
            for j in range(self._forms[term.other].digits):
                one, other = Digit(term.value, term.first + i), Digit(term.other, j)
                yield Product(one, other=other), i + j + shift // self._bits

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

    def _accumulator_bits(self, scheduler: Scheduler) -> int:
        """Return the width, by interval arithmetic with any values of the digits; at least that of a word."""
        low = high = least = most = 0
        operand = (0, 0)
        for instruction, digits in zip(scheduler.instructions, scheduler.reads, strict=True):
            opcode, constant, second = instruction.opcode, instruction.constant, instruction.second_constant
            word, beside = map(self._range, digits)
            factors = operand if opcode in PRODUCTS else (constant, constant)
            ends = [a * b for a in word for b in factors]
            more = [a * second for a in beside]
            low, high = low + min(ends) + min(more), high + max(ends) + max(more)
            if opcode is Opcode.OPERAND:
                operand = word
            if opcode is not Opcode.TAKE:
                least, most = min(least, low), max(most, high)
            if opcode in CARRIES:
                low, high = low >> self._bits, high >> self._bits
            elif opcode in CLEARS:
                low = high = 0
        return max((-least - 1).bit_length(), most.bit_length(), self._bits) + 1

    def _range(self, digit: Digit) -> tuple[int, int]:
        """Return the range of a digit."""
        if digit == ONE:
            return 1, 1
        node, form = self._nodes[digit.value], self._forms[digit.value]
        if digit.number < form.digits - 1:
            return 0, (1 << self._bits) - 1
        shift = form.frac - node.frac - self._bits * digit.number
        return _shifted(node.low, shift), _shifted(node.high, shift)


def _shifted(code: int, shift: int) -> int:
    return code << shift if shift >= 0 else code >> -shift


def _fraction_bits(number: int, frac: int) -> int:
    """Return the fraction bits that ``number * 2**-frac`` takes."""
    return max(0, frac - (number & -number).bit_length() + 1) if number else 0
