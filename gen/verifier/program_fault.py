"""Finds the instruction that is to blame when a program stores a value that no node of the graph has.

The value is compared, column by column, with the node that has most terms in common with it. In the first column that
differs, one instruction may be found whose change makes them agree; otherwise it is the one that ends the column.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import NamedTuple

from sosmith.gen.verifier.graph_forms import Graph
from sosmith.gen.verifier.normal_form import Form, constant, plus, scaled, times, valuation
from sosmith.gen.verifier.program_text import Instruction, ProgramText


class Word(NamedTuple):
    """What a memory word holds: a form in low..high, and the instruction that stored it in this sample, if one did."""

    form: Form
    low: int
    high: int
    writer: int | None


class Contribution(NamedTuple):
    """What an instruction adds to the accumulator: its word times a factor, in a column.

    `operand` is the instruction that has read the factor of a PRODUCT.
    """

    number: int
    product: Form
    factor: Form
    column: int
    operand: int | None


@dataclass
class Group:
    """The instructions from an empty accumulator to the one that empties it: what they add, and the ends of columns."""

    instructions: list[int] = field(default_factory=list)
    contributions: list[Contribution] = field(default_factory=list)
    ends: list[int] = field(default_factory=list)


class _Place(NamedTuple):
    """A word to read: what it holds or held, its address, the instruction that stored it, and whether it still does."""

    form: Form
    address: int
    writer: int | None
    current: bool


def fault(
    program: ProgramText,
    graph: Graph,
    values: Sequence[Form],
    group: Group,
    words: Sequence[Word],
    history: Sequence[tuple[Word, int]],
) -> str:
    """Return the sentence that says which instruction of a group goes wrong first, and for which node."""
    return _Search(program, graph, values, group, words, history).sentence()


class _Search:
    """The search for one sentence."""

    def __init__(
        self,
        program: ProgramText,
        graph: Graph,
        values: Sequence[Form],
        group: Group,
        words: Sequence[Word],
        history: Sequence[tuple[Word, int]],
    ) -> None:
        self._program, self._group = program, group
        self._bits = program.digit_bits
        self._places = [_Place(word.form, address, word.writer, True) for address, word in enumerate(words)]
        self._places += [_Place(word.form, address, word.writer, False) for word, address in reversed(history)]
        self._node, self._wanted = self._closest(values)
        self._label = graph.nodes[self._node].label if self._node >= 0 else "any node"

    def _sum(self, columns: int) -> Form:
        total: Form = {}
        for part in self._group.contributions:
            if part.column < columns:
                total = plus(total, part.product, 1 << (self._bits * part.column))
        return total

    def _closest(self, values: Sequence[Form]) -> tuple[int, Form]:
        """Return the node that has most terms in common with the sum of the group, as an integer; -1 if none has."""
        count = len(self._group.ends)
        modulus = 2 << (self._bits * count)
        total = {m: c for m, c in self._sum(count).items() if c % modulus}
        best, found = (0, 0), (-1, constant(0))
        for node, value in enumerate(values):
            shared = total.keys() & value.keys()
            exponents = Counter(valuation(total[m]) - valuation(value[m]) for m in shared if total[m])
            for exponent, _ in exponents.most_common(3):
                form = scaled(value, exponent)
                apart = sum((total.get(m, 0) - form.get(m, 0)) % modulus != 0 for m in total.keys() | form.keys())
                score = len(shared) - 2 * apart, -apart
                if found[0] < 0 or score > best:
                    best, found = score, (node, form)
        return found

    def sentence(self) -> str:
        ends = self._group.ends
        if self._node < 0:
            return f"{self._program.named(ends[-1])} must complete the value of a node, not one that has nothing in common with any"
        for column, end in enumerate(ends):
            rest = plus(self._wanted, self._sum(column + 1), -1)
            top = self._bits * (column + 1) + (end == ends[-1])
            if any(c % (1 << top) for c in rest.values()):
                missing = scaled(rest, -self._bits * column)
                return self._blame(column, {m: c for m, c in missing.items() if c % (1 << self._bits)})
        return f"{self._program.named(ends[-1])} must complete {self._label} in a range that it has, not outside of it"

    def _blame(self, column: int, missing: Form) -> str:
        """Return the sentence for a column that lacks `missing`, a form modulo ``2**digit_bits``."""
        start = self._group.ends[column - 1] if column else -1
        inside = {part.number: part for part in self._group.contributions if part.column == column}
        end = self._group.ends[column]
        for number in [n for n in self._group.instructions if start < n < end]:
            part = inside.get(number)
            if part is None:
                text = self._instead(number, missing, None)
            else:
                text = self._instead(number, plus(missing, part.product), part)
            if text:
                return text
        return f"{self._program.named(end)} must end digit {column} of {self._label}, not of another value"

    def _instead(self, number: int, wanted: Form, part: Contribution | None) -> str:
        """Return the sentence if an instruction could add `wanted` with one other field."""
        if part and part.operand is not None:
            return self._factor(number, wanted, part)
        _, address, value = self._program.instructions[number]
        wanted = self._reduced(wanted)
        if not wanted:
            return self._must_be(number, Instruction("nothing", 0, 0)) if part else ""
        here = self._places[address]
        solved = self._constant(wanted, here.form, value)
        if solved is not None and (part or solved == value):
            return self._must_be(number, Instruction("multiply", address, solved))
        if part is None:
            return ""
        for place in self._places:
            if not self._reduced(plus(wanted, place.form, -value)):
                return self._must_read(number, place, Instruction("multiply", place.address, value))
        return ""

    def _factor(self, number: int, wanted: Form, part: Contribution) -> str:
        """Return the sentence if a PRODUCT or its OPERAND should have read another word."""
        own = self._places[self._program.instructions[number].address].form
        for place in self._places:
            if not self._reduced(plus(wanted, times(place.form, part.factor), -1)):
                return self._must_read(number, place, Instruction("product", place.address, 0))
            if part.operand is not None and not self._reduced(plus(wanted, times(place.form, own), -1)):
                return self._must_read(part.operand, place, Instruction("operand", place.address, 0))
        return ""

    def _must_be(self, number: int, wanted: Instruction) -> str:
        return f"instruction {number} must be {wanted} for {self._label}, not {self._program.instructions[number]}"

    def _must_read(self, number: int, place: _Place, wanted: Instruction) -> str:
        """Return the sentence for a word that is read elsewhere, or is no longer there."""
        if place.address == self._program.instructions[number].address:
            later = self._places[place.address].writer
            if later is not None:
                return f"{self._program.named(later)} must not store where {self._program.named(number)} reads for {self._label}"
        if place.writer is None:
            return self._must_be(number, wanted)
        return (
            f"{self._program.named(number)} must read what {self._program.named(place.writer)} stores for {self._label}, "
            "not another word"
        )

    def _reduced(self, form: Form) -> Form:
        return {monomial: c for monomial, c in form.items() if c % (1 << self._bits)}

    def _constant(self, wanted: Form, word: Form, present: int) -> int | None:
        """Solve ``wanted == constant * word`` modulo ``2**digit_bits``; prefer what is close to the present one."""
        base = 1 << self._bits
        for monomial, coefficient in word.items():
            target = Fraction(wanted.get(monomial, 0))
            if target.denominator == 1 and Fraction(coefficient).denominator == 1 and coefficient % 2:
                found = int(target) * pow(int(coefficient), -1, base) % base
                if self._reduced(plus(wanted, word, -found)):
                    return None
                return min((found, found - base), key=lambda value: ((value ^ present) % (2 * base)).bit_count())
        return None
