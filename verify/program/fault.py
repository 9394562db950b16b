"""Says where a program goes wrong that stores a value which no node of the graph has.

The value is compared, digit by digit, with the node that has most terms in common with it. This is a guess, for the
sentence of a rejection: several nodes can be as close.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from sosmith.verify.program.graph_forms import Graph
from sosmith.verify.program.normal_form import Form, plus, scaled, valuation
from sosmith.verify.program.text import ProgramText


class Contribution(NamedTuple):
    """What an instruction adds to the accumulator, and how many digits have been split off before."""

    product: Form
    column: int


@dataclass
class Group:
    """The instructions from an empty accumulator to the one that empties it: what they add, and the ends of columns."""

    instructions: list[int] = field(default_factory=list)
    contributions: list[Contribution] = field(default_factory=list)
    ends: list[int] = field(default_factory=list)

    def total(self, columns: int, digit_bits: int) -> Form:
        """Return the sum of the lowest columns."""
        total: Form = {}
        for product, column in self.contributions:
            if column < columns:
                total = plus(total, product, 1 << (digit_bits * column))
        return total


def fault(program: ProgramText, graph: Graph, values: Sequence[Form], group: Group) -> str:
    """Return the sentence about a group whose sum is not that of a node; `values` are those of all nodes."""
    bits, ends = program.digit_bits, group.ends
    node, wanted = _closest(group.total(len(ends), bits), 2 << (bits * len(ends)), values)
    if node is None:
        return f"{program.named(ends[-1])} must complete the value of a node, not one that is like none of them"
    label = graph.nodes[node].label
    for column, end in enumerate(ends):
        rest = plus(wanted, group.total(column + 1, bits), -1)
        modulus = (2 if end == ends[-1] else 1) << (bits * (column + 1))
        if any(coefficient % modulus for coefficient in rest.values()):
            return f"{program.named(end)} must end digit {column} of {label}, not of another value"
    return f"{program.named(ends[-1])} must complete {label} in a range that it has, not outside of it"


def _closest(total: Form, modulus: int, values: Sequence[Form]) -> tuple[int | None, Form]:
    """Return the node that has most terms in common with a sum, as an integer; None if no node has any."""
    total = {monomial: coefficient for monomial, coefficient in total.items() if coefficient % modulus}
    scores: dict[tuple[int, int], tuple[int, Form]] = {}
    for node, value in enumerate(values):
        shared = total.keys() & value.keys()
        exponents = Counter(valuation(total[m]) - valuation(value[m]) for m in shared)
        for exponent, _ in exponents.most_common(1):
            form = scaled(value, exponent)
            apart = sum((total.get(m, 0) - form.get(m, 0)) % modulus != 0 for m in total.keys() | form.keys())
            scores.setdefault((len(shared) - 2 * apart, -apart), (node, form))
    return scores[max(scores)] if scores else (None, {})
