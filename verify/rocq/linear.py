"""The linear model of a stage, from its graph alone: for every node a quotient of polynomials to each source.

Nothing proven depends on this: Rocq checks what it finds against the graph, node by node.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

from sosmith.verify.certificate_file import NodeEntry, Operation, StageEntry
from sosmith.verify.graph import RejectedError
from sosmith.verify.rocq.polynomials import Polynomial, added, product, trimmed

_QUANTIZERS = {Operation.FLOOR, Operation.FRACTION, Operation.TRUNCATE}
_PASSED = {Operation.BOUND, Operation.SHIFT}

Source = tuple[str, int, int]
"""What drives a stage: ("node", index, 0), or a rounding: ("floor" or "truncate", undelayed node, bits dropped)."""

_Form = dict[int | Source, Polynomial]
"""A code as a sum over states (by index of the DELAY) and sources, of polynomials."""


@dataclass(frozen=True)
class LinearStage:
    """The codes of a linear stage's nodes, as polynomials in codes of its sources over one denominator.

    Raises
    ------
    RejectedError
        From every property, if a node is not linear.
    """

    stage: StageEntry

    @cached_property
    def states(self) -> list[int]:
        """Indices of the delays."""
        return [index for index, node in enumerate(self.stage.nodes) if node.op is Operation.DELAY]

    @cached_property
    def sources(self) -> list[Source]:
        """All sources, the inputs first."""
        found = dict.fromkeys(key for form in self._forms for key in form if isinstance(key, tuple))
        inputs = [key for key in self._inputs if key in found]
        return [*inputs, *(key for key in found if key not in inputs)]

    @property
    def _inputs(self) -> list[Source]:
        return [("node", index, 0) for index, node in enumerate(self.stage.nodes) if node.op is Operation.INPUT]

    @cached_property
    def denominator(self) -> Polynomial:
        """``det(I - w A)`` of the state matrix A, which begins with 1."""
        return self._solved[0]

    def numerator(self, node: int, source: Source) -> Polynomial:
        """Polynomial from the code of `source` to that of `node`, over `denominator`."""
        form = self._forms[node]
        result = product(form.get(source, []), self.denominator)
        for state, weight in form.items():
            if isinstance(state, int):
                result = added(result, product(weight, self._solved[1][state].get(source, [])))
        return trimmed(result)

    @cached_property
    def _forms(self) -> list[_Form]:
        forms: list[_Form] = []
        for index, node in enumerate(self.stage.nodes):
            operands = [] if node.op is Operation.DELAY else [forms[i] for i in node.operands]
            forms.append(self._form(index, node, operands))
        return forms

    def _form(self, index: int, node: NodeEntry, operands: Sequence[_Form]) -> _Form:
        nodes = self.stage.nodes
        if node.op is Operation.DELAY:
            return {index: [Fraction(1)]}
        if node.op in {Operation.INPUT, Operation.CONSTANT}:
            return {("node", index, 0): [Fraction(1)]}
        if node.op in _QUANTIZERS:
            kept = node.parameter if node.op is Operation.FRACTION else node.frac
            dropped = nodes[node.operands[0]].frac - kept
            error = self._rounding(node, dropped)
            if node.op is Operation.FRACTION:
                return error
            return _times(_sum(operands[0], error, -1), Fraction(1, 1 << dropped))
        if node.op in {Operation.ADD, Operation.SUBTRACT}:
            up = [Fraction(2) ** (node.frac - nodes[i].frac) for i in node.operands]
            second = up[1] if node.op is Operation.ADD else -up[1]
            return _sum(_times(operands[0], up[0]), operands[1], second)
        if node.op is Operation.SCALE:
            return _times(operands[0], Fraction(node.parameter))
        if node.op not in _PASSED:
            raise RejectedError(f"node {index} ({node.op.value}) of {self.stage.name} must be linear")
        return operands[0]

    def _rounding(self, node: NodeEntry, dropped: int) -> _Form:
        """Return what a quantizer drops: that of the undelayed node, delayed."""
        at, delay = node.operands[0], 0
        while self.stage.nodes[at].op is Operation.DELAY and delay <= len(self.stage.nodes):
            at, delay = self.stage.nodes[at].operands[0], delay + 1
        kind = "truncate" if node.op is Operation.TRUNCATE else "floor"
        return {(kind, at, dropped): [*[Fraction(0)] * delay, Fraction(1)]}

    @cached_property
    def _solved(self) -> tuple[Polynomial, Mapping[int, _Form]]:
        """Denominator, and for each state its numerators; by the recursion of Faddeev and LeVerrier."""
        states = self.states
        following = [self._forms[self.stage.nodes[state].operands[0]] for state in states]
        matrix = [[_constant(form.get(other, [])) for other in states] for form in following]
        size = len(states)
        adjugate = [[[Fraction(i == j)] for j in range(size)] for i in range(size)]
        power = [[Fraction(i == j) for j in range(size)] for i in range(size)]
        denominator = [Fraction(1)]
        for k in range(1, size + 1):
            made = [
                [
                    sum((a * b for a, b in zip(row, column, strict=True) if a), Fraction(0))
                    for column in zip(*power, strict=True)
                ]
                for row in matrix
            ]
            coefficient = -sum((made[i][i] for i in range(size)), Fraction(0)) / k
            denominator.append(coefficient)
            power = [[value + coefficient * (i == j) for j, value in enumerate(row)] for i, row in enumerate(made)]
            for i, row in enumerate(power):
                for j, value in enumerate(row):
                    adjugate[i][j].append(value)
        solved: dict[int, _Form] = {}
        for i, state in enumerate(states):
            numerators: _Form = {}
            for j, form in enumerate(following):
                for key, weight in form.items():
                    if isinstance(key, tuple):
                        part = product([Fraction(0), *adjugate[i][j]], weight)
                        numerators[key] = added(numerators.get(key, []), part)
            solved[state] = {key: trimmed(value) for key, value in numerators.items()}
        return trimmed(denominator), solved


def _constant(polynomial: Polynomial) -> Fraction:
    return polynomial[0] if polynomial else Fraction(0)


def _times(form: _Form, factor: Fraction) -> _Form:
    return {key: [value * factor for value in polynomial] for key, polynomial in form.items()}


def _sum(a: _Form, b: _Form, factor: Fraction | int) -> _Form:
    result = dict(a)
    for key, value in b.items():
        result[key] = added(result.get(key, []), value, factor)
    return result
