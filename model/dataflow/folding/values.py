"""The values that a program stores, in digits, and what each value of a datapath is made of.

A value is stored if it is a port or a state, or if it is cut, delayed or multiplied as a whole. All others are
multiples of stored digits and a constant.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import copy
from typing import NamedTuple

from sosmith.model.dataflow.folding.flat import Flat
from sosmith.model.dataflow.graph import Node, Op
from sosmith.model.dataflow.scheduling import ONE, Digit

_FEW = 3
"""Products of a sum that may be computed again where it is needed early."""


class FoldingError(ValueError):
    """The datapath cannot be computed by one multiply-accumulate unit."""


class Term(NamedTuple):
    """Digits of a stored value: `length` of them from `first` on; times the stored value `other`, unless that is -1."""

    value: int
    first: int
    length: int
    other: int = -1


class Form(NamedTuple):
    """How a value is stored: number of digits, and fraction bits of the code that they make."""

    digits: int
    frac: int


class Total(NamedTuple):
    """Multiples of stored digits and a constant: integers that are all multiples of ``2**-frac``.

    Digits are read as a number with the fraction bits of the lowest one.
    """

    weights: dict[Term, int]
    constant: int
    frac: int

    def times(self, factor: int, frac: int) -> Total:
        """Return the product with ``factor * 2**-frac``."""
        weights = {term: weight * factor for term, weight in self.weights.items()}
        return Total(weights, self.constant * factor, self.frac + frac)


class Values:
    """Decides which values to store, and says what they are made of.

    Attributes
    ----------
    nodes : list of Node
        All of the datapath, but for a limit at its output.
    inputs : list of int
        Nodes that are its inputs.
    output : int
        Node that is its output.
    bits : int
        Of a digit.
    stored : set of int
        Nodes that are stored.
    fracs : dict of int to int
        Fraction bits of each stored code.
    forms : dict of int to Form
        How each of them is stored.
    repeats : int
        The stored value whose sum repeats others; -1 for none.
    """

    def __init__(self, flat: Flat, digit_bits: int, kept: Mapping[str, int]) -> None:
        self.nodes, self.inputs, self.output = list(flat.nodes), flat.inputs, flat.output
        self.bits = digit_bits
        last = self.nodes[self.output]
        if last.op is Op.CLAMP:  # done on the way out
            self.nodes.remove(last)
            self.output = last.operands[0]
        self.stored = self._find_stored()
        self.fracs = self._find_fracs()
        while apart := self._cut_elsewhere():
            self.stored |= apart
            self.fracs = self._find_fracs()
        self._totals: dict[int, Total] = {}
        self.forms = {index: self._form(index, kept) for index in sorted(self.stored)}
        self._repeated: frozenset[int] = frozenset()
        self.repeats = -1

    def _form(self, index: int, kept: Mapping[str, int]) -> Form:
        node, frac = self.nodes[index], self.fracs[index]
        count = self._digits(shifted(node.low, frac - node.frac), shifted(node.high, frac - node.frac))
        return Form(max(count, kept.get(self.name(index), 0)), frac)

    def name(self, index: int) -> str:
        return self.nodes[index].name or f"value{index}"

    def repeatable(self) -> list[int]:
        """Return the stored values whose sums may repeat those of others that they need, see `_few_and_early`."""
        repeated = {*self._few_and_early()}
        return [
            index
            for index in sorted(self.stored - {*self.inputs, *self.delays()})
            if repeated.intersection(term.value for term in self.sum(index).weights)
        ]

    def repeating(self, index: int) -> Values:
        """Return the same but that the sum of a stored value repeats others, see `_few_and_early`."""
        other = copy(self)
        other.repeats = index
        return other

    def delays(self) -> list[int]:
        return [index for index, node in enumerate(self.nodes) if node.op is Op.DELAY]

    def range_of(self, digit: Digit) -> tuple[int, int]:
        """Return the range of a digit."""
        if digit == ONE:
            return 1, 1
        node, form = self.nodes[digit.value], self.forms[digit.value]
        if digit.number < form.digits - 1:
            return 0, (1 << self.bits) - 1
        shift = form.frac - node.frac - self.bits * digit.number
        return shifted(node.low, shift), shifted(node.high, shift)

    # What is stored.

    def _find_stored(self) -> set[int]:
        """Return the nodes to store: ports, states, and whatever is cut, delayed or multiplied as a whole."""
        stored = {*self.inputs, self.output}
        for index, node in enumerate(self.nodes):
            first = node.operands[0] if node.operands else -1
            if node.op is Op.DELAY:
                is_cut = self.nodes[first].op in {Op.FLOOR, Op.FRACTION}
                stored |= {index} if is_cut else {index, first}
            elif node.op is Op.FRACTION:
                stored.add(first)
            elif node.op is Op.MULTIPLY:
                stored |= {i for i in node.operands if self.nodes[i].op is not Op.CONSTANT}
            elif node.op is Op.SCALE and self.nodes[first].op in {Op.ADD, Op.SUBTRACT, Op.SHIFT, Op.BOUND}:
                stored.add(first)
            elif node.op in {Op.CLAMP, Op.TRUNCATE}:
                raise FoldingError(f"the datapath must not {node.op.value} inside to be folded")
        for index, node in enumerate(self.nodes):
            if node.op is Op.FLOOR and node.operands[0] not in stored:
                stored.add(index)
        return {i for i in stored if self.nodes[i].op is not Op.CONSTANT}

    def _cut_elsewhere(self) -> set[int]:
        """Return the FLOOR nodes whose cut is not between two digits of the stored value; they are stored too."""
        return {
            index
            for index, node in enumerate(self.nodes)
            if node.op is Op.FLOOR
            and index not in self.stored
            and (self.fracs[node.operands[0]] - node.frac) % self.bits
        }

    def _find_fracs(self) -> dict[int, int]:
        """Return the fraction bits of each stored code: at least its node's, with its first cut between two digits."""
        stored = self.stored
        group = {i: self._first_source(i) if self.nodes[i].op is Op.DELAY else i for i in stored}
        cuts: dict[int, int] = {}
        for node in self.nodes:
            if node.op in {Op.FLOOR, Op.FRACTION}:
                operand = node.operands[0]
                if operand in self.stored:
                    cuts.setdefault(group[operand], node.parameter if node.op is Op.FRACTION else node.frac)
            elif node.op is Op.MULTIPLY and all(self.nodes[i].op is not Op.CONSTANT for i in node.operands):
                cuts.setdefault(group[node.operands[1]], 0)
        fracs = {}
        for index in self.stored:
            frac = max(self.nodes[i].frac for i in self.stored if group[i] == group[index])
            cut = cuts.get(group[index], frac)
            fracs[index] = cut + self.bits * -(-(frac - cut) // self.bits)
        return fracs

    def _first_source(self, index: int) -> int:
        """Follow a chain of delays to what it begins with; for the lower digits of a stored value, to that."""
        while self.nodes[index].op is Op.DELAY:
            index = self.nodes[index].operands[0]
        node = self.nodes[index]
        if node.op is Op.FRACTION and node.operands[0] in self.stored:
            return self._first_source(node.operands[0])
        return index

    def _digits(self, low: int, high: int) -> int:
        """Return the number of digits that hold the range."""
        count = 1
        while not (-(1 << (self.bits * count)) <= low and high < 1 << (self.bits * count)):
            count += 1
        return count

    # What values are made of.

    def value(self, index: int) -> Total:
        """Return a node as multiples of stored digits and a constant."""
        if index in self.stored and index not in self._repeated:
            return self._whole(index)
        if index not in self._totals:
            self._totals[index] = self._definition(index)
        return self._totals[index]

    def _whole(self, index: int) -> Total:
        """Return a stored value as its own digits."""
        return Total({Term(index, 0, self.forms[index].digits): 1}, 0, 0)

    def _few_and_early(self) -> Iterator[int]:
        """Find stored values that are sums of few digits, all of them there before the sample or taken with it.

        A sum that needs such a value may add up the same digits instead, which are there earlier.
        """
        early = {*self.inputs, *self.delays()}
        for index in sorted(self.stored - early - {self.output}):
            if self.nodes[index].op in {Op.FLOOR, Op.FRACTION}:
                continue
            terms = self._definition(index).weights
            count = sum(term.length * (self.forms[term.other].digits if term.other >= 0 else 1) for term in terms)
            if count <= _FEW and early.issuperset(of for term in terms for of in (term.value, term.other) if of >= 0):
                yield index

    def _definition(self, index: int) -> Total:
        """Return a node as multiples of stored digits and a constant, from its operands."""
        node = self.nodes[index]
        if node.op is Op.CONSTANT:
            return Total({}, node.parameter, node.frac)
        if node.op is Op.ADD or node.op is Op.SUBTRACT:
            sign = 1 if node.op is Op.ADD else -1
            a, b = map(self.value, node.operands)
            frac = max(a.frac, b.frac)
            up, more = frac - a.frac, sign << (frac - b.frac)
            total = {term: weight << up for term, weight in a.weights.items()}
            for term, weight in b.weights.items():
                total[term] = total.get(term, 0) + more * weight
            constant = (a.constant << up) + more * b.constant
            return Total({term: weight for term, weight in total.items() if weight}, constant, frac)
        if node.op is Op.SHIFT:
            return self.value(node.operands[0]).times(1, -node.parameter)
        if node.op is Op.SCALE:
            return self.value(node.operands[0]).times(node.parameter, node.parameter_frac)
        if node.op is Op.BOUND:
            return self.value(node.operands[0])
        if node.op is Op.MULTIPLY:
            return self._product(*node.operands)
        if node.op in {Op.FLOOR, Op.FRACTION}:
            return self._cut(node)
        raise FoldingError(f"the datapath must not {node.op.value} inside to be folded")

    def _product(self, a: int, b: int) -> Total:
        """Return the product of two nodes, one of which may be a constant."""
        for one, other in ((a, b), (b, a)):
            if self.nodes[one].op is Op.CONSTANT:
                return self.value(other).times(self.nodes[one].parameter, self.nodes[one].frac)
        return Total({Term(a, 0, self.forms[a].digits, b): 1}, 0, 0)

    def _cut(self, node: Node) -> Total:
        """Return the upper or the lower digits of a stored value."""
        root = node.operands[0]
        if root not in self.stored:
            raise FoldingError(f"{node.name!r} must cut a stored value to be folded")
        form = self.forms[root]
        kept = node.parameter if node.op is Op.FRACTION else node.frac
        lower, rest = divmod(form.frac - kept, self.bits)
        if rest:
            raise FoldingError(f"{node.name!r} must cut its value where another quantizer does to be folded")
        if node.op is Op.FRACTION:
            return Total({Term(root, 0, lower): 1} if lower else {}, 0, 0)
        if lower >= form.digits:
            raise FoldingError(f"{node.name!r} must leave a digit to be folded")
        return Total({Term(root, lower, form.digits - lower): 1}, 0, 0)

    def sum(self, index: int) -> Total:
        """Return a stored value in terms of other stored values."""
        if index != self.repeats or self._repeated:
            return self._own_sum(index)
        kept, self._totals, self._repeated = self._totals, {}, frozenset(self._few_and_early())
        repeating = self._own_sum(index)
        self._totals, self._repeated = kept, frozenset()
        return repeating

    def _own_sum(self, index: int) -> Total:
        node = self.nodes[index]
        if node.op not in {Op.FLOOR, Op.DELAY}:
            return self._definition(index)
        (source,) = node.operands
        return self._whole(source) if source in self.stored else self.value(source)

    def copied(self, index: int) -> list[tuple[Digit, Digit]]:
        """Return the digits that a state takes over, each with its own; none if they are not just those of a value."""
        total, form = self.sum(index), self.forms[index]
        if total.constant or len(total.weights) != 1:
            return []
        ((term, weight),) = total.weights.items()
        if term.other >= 0 or weight != shifted(1, total.frac) or (term.length, self.frac_of(term)) != form:
            return []
        return [(Digit(term.value, term.first + k), Digit(index, k)) for k in range(form.digits)]

    def frac_of(self, term: Term) -> int:
        """Return the fraction bits of a term: those of the lowest digit, or of its product with the other value."""
        frac = self.forms[term.value].frac - self.bits * term.first
        return frac if term.other < 0 else frac + self.forms[term.other].frac


def shifted(code: int, shift: int) -> int:
    return code << shift if shift >= 0 else code >> -shift


def fraction_bits(number: int, frac: int) -> int:
    """Return the fraction bits that ``number * 2**-frac`` takes."""
    return max(0, frac - (number & -number).bit_length() + 1) if number else 0
