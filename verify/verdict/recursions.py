"""The recursions of a certificate's sections: one for each output that has a past, and what their structure is called.

A realization's name is a claim about the graphs. It is decided here by what the states of the loops hold:

- df1, df1_ef1, df1_ef2: the output before its quantizer, one and two samples ago; with the order of the error feedback;
- look_ahead_N: the output N and 2 N samples ago, and nothing in between;
- df2t, delta: the output is the first state and what the input adds; the second state feeds the first, and is itself
  fed by the second (delta) or not (df2t);
- state_space, normal: any others, with input weights that are powers of two; normal if states are truncated;
- fir_direct, fir_symmetric, fir_transposed: no state is in a loop. The states hold earlier inputs, and a product takes
  one of them or several; or each product takes the new input;
- lattice_wdf: outputs of allpass functions, which the last section, without a past, adds up.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

from flint import fmpq

from sosmith.verify.bounds.l1_response import fraction
from sosmith.verify.certificate_file import Certificate, Operation, StageEntry
from sosmith.verify.graph import Source, Transfer, inputs_of
from sosmith.verify.start import section_alone

_LOOK_AHEAD = re.compile(r"look_ahead_([0-9]{1,3})")
_FEEDBACK = {"df1": (0, 0), "df1_ef1": (1, 0), "df1_ef2": (2, 1)}
"""Largest weights of the error feedback."""
_NAMES = {*_FEEDBACK, "df2t", "delta", "state_space", "normal"}


_OF_SUMS = frozenset(
    {Operation.ADD, Operation.SUBTRACT, Operation.SHIFT, Operation.BOUND, Operation.FLOOR, Operation.DELAY}
)
"""What sums of a node and its earlier values are made of."""


@dataclass(frozen=True)
class Recursion:
    """The part of a section that leads to one output.

    Attributes
    ----------
    name : str
        Name of the section, followed by that of the output where there are several.
    stage : StageEntry
        The part.
    """

    name: str
    stage: StageEntry

    @cached_property
    def transfer(self) -> Transfer:
        """Its transfer functions."""
        return Transfer(self.stage)

    @property
    def output(self) -> int:
        """Index of its output."""
        return self.stage.outputs[0]

    @property
    def is_single(self) -> bool:
        """Whether it has one input."""
        return len(inputs_of(self.stage)) == 1

    @cached_property
    def total(self) -> int:
        """Index of the output before its quantizer."""
        node = self.stage.nodes[self.output]
        return node.operands[0] if node.op is Operation.FLOOR else self.output

    @cached_property
    def loop(self) -> list[int]:
        """Positions of the states that what they hold comes back to."""
        matrix = self.transfer.matrix
        size = range(len(matrix))
        reach = [[bool(matrix[i][j]) for j in size] for i in size]
        for k in size:
            for i in size:
                if reach[i][k]:
                    reach[i] = [a or b for a, b in zip(reach[i], reach[k], strict=True)]
        return [k for k in size if reach[k][k]]

    @cached_property
    def loop_matrix(self) -> list[list[Fraction]]:
        """Rows and columns of the state matrix that belong to the states in a loop."""
        return [[fraction(self.transfer.matrix[i][j]) for j in self.loop] for i in self.loop]

    def _holds(self, root: int) -> bool:
        """Whether a state in a loop holds earlier values of a node, and all the others do or hold sums of them."""
        kept = {self.transfer.undelayed(self.transfer.states[k])[0] for k in self.loop}
        return root in kept and all(self._is_sum_of(index, root) for index in kept)

    def _is_sum_of(self, index: int, root: int) -> bool:
        """Whether a node adds up nothing but a node and its earlier values."""
        left, seen = [index], {root}
        while left:
            at = left.pop()
            if at not in seen:
                seen.add(at)
                node = self.stage.nodes[at]
                if node.op not in _OF_SUMS:
                    return False
                left += node.operands
        return True

    @cached_property
    def is_direct(self) -> bool:
        """Whether it is a direct form I, which goes back two samples at most."""
        return self.is_single and self.transfer.denominator.degree() <= 2 and self._holds(self.total)

    def looks_ahead(self, distance: int) -> bool:
        """Whether its loop holds the output alone, of up to twice so many samples ago, and goes back that far."""
        powers = {k for k, value in enumerate(self.transfer.denominator.coeffs()) if value}
        roots = {self.transfer.undelayed(self.transfer.states[k])[0] for k in self.loop}
        return distance > 1 and powers <= {0, distance, 2 * distance} and roots <= {self.output}

    @cached_property
    def error_feedback(self) -> tuple[int, ...] | None:
        """Weights of the bits that earlier samples dropped; None if it is no direct form, or drops none."""
        node = self.stage.nodes[self.output]
        if not self.is_direct or node.op is not Operation.FLOOR:
            return None
        source: Source = (Operation.FLOOR, self.transfer.undelayed(self.total)[0], node.frac)
        first, *weights = [-value for value in self.transfer.numerator(source, self.output).coeffs()]
        if first != 1 or len(weights) > 2 or any(weight.q != 1 for weight in weights):
            return None
        return (*(int(weight.p) for weight in weights), 0, 0)[:2]


def recursions_of(certificate: Certificate) -> list[list[Recursion]]:
    """Return the recursions of each section of a certificate that was accepted."""
    steady = any(stage.role == "start" for stage in certificate.stages)
    stages = [stage for stage in certificate.stages if stage.role == "section"]
    if steady and stages and len(inputs_of(stages[0])) > 1:
        stages = [section_alone(stage) for stage in stages]
    return [_recursions(stage) for stage in stages]


def _recursions(stage: StageEntry) -> list[Recursion]:
    if len(inputs_of(stage)) == len(stage.outputs) == 1:
        return [Recursion(stage.name, stage)]
    parts = [(stage.nodes[output].name, _leading_to(stage, output)) for output in stage.outputs]
    return [
        Recursion(f"{stage.name} {name}", part)
        for name, part in parts
        if any(node.op is Operation.DELAY for node in part.nodes)
    ]


def _leading_to(stage: StageEntry, output: int) -> StageEntry:
    """Return the part of a section that leads to one of its nodes."""
    reached, pending = {output}, [output]
    while pending:
        new = set(stage.nodes[pending.pop()].operands) - reached
        reached |= new
        pending += new
    kept = sorted(reached)
    place = {index: k for k, index in enumerate(kept)}
    nodes = [
        stage.nodes[index].model_copy(update={"operands": tuple(place[i] for i in stage.nodes[index].operands)})
        for index in kept
    ]
    return stage.model_copy(update={"nodes": tuple(nodes), "outputs": (place[output],)})


def is_realized_as(name: object, sections: Sequence[Sequence[Recursion]]) -> bool:
    """Whether the name of a realization is true of all sections.

    Parameters
    ----------
    name : object
        The name; anything but one of those above is true of no section.
    sections : sequence of sequence of Recursion
        Recursions of each section, as `recursions_of` returns them.
    """
    if not isinstance(name, str):
        return False
    if name == "lattice_wdf":
        *branches, last = sections
        return bool(branches) and not last and all(_is_allpass(each) for section in branches for each in section)
    single = [section[0] for section in sections if len(section) == 1]
    return len(single) == len(sections) > 0 and all(_is(name, each) for each in single)


def _is(name: str, part: Recursion) -> bool:
    nodes = part.stage.nodes
    match = _LOOK_AHEAD.fullmatch(name)
    if match is not None:
        return part.looks_ahead(int(match[1]))
    if name in _FEEDBACK and part.loop:
        most, weights = _FEEDBACK[name], part.error_feedback or (0, 0)
        return part.is_direct and all(abs(weight) <= limit for weight, limit in zip(weights, most, strict=True))
    if name in _FIR:
        return not part.loop and part.is_single and _FIR[name](part)
    if not part.loop and part.is_single:
        return name in _NAMES
    if part.is_direct or len(part.loop) > 2 or not part.is_single:
        return False
    truncates = any(node.op is Operation.TRUNCATE for node in nodes)
    if name in {"df2t", "delta"}:
        return not truncates and _is_transposed(part, delta=name == "delta")
    return name == ("normal" if truncates else "state_space") and _has_plain_inputs(part)


def _is_direct_fir(part: Recursion) -> bool:
    """Whether each product takes one input, new or earlier."""
    nodes = part.stage.nodes
    return all(
        nodes[part.transfer.undelayed(node.operands[0])[0]].op is Operation.INPUT
        for node in nodes
        if node.op is Operation.SCALE
    ) and _has_delay_line(part)


def _has_delay_line(part: Recursion) -> bool:
    """Whether all states hold earlier inputs."""
    transfer = part.transfer
    return all(part.stage.nodes[transfer.undelayed(state)[0]].op is Operation.INPUT for state in transfer.states)


def _takes_new_input(part: Recursion) -> bool:
    """Whether each product takes the new input."""
    nodes = part.stage.nodes
    return all(nodes[node.operands[0]].op is Operation.INPUT for node in nodes if node.op is Operation.SCALE)


_FIR: dict[str, Callable[[Recursion], bool]] = {
    "fir_direct": _is_direct_fir,
    "fir_symmetric": _has_delay_line,
    "fir_transposed": _takes_new_input,
}
"""What is true of the structure of each FIR filter."""


def _is_transposed(part: Recursion, *, delta: bool) -> bool:
    """Whether the output is the first state and what the input adds, and the second state is a sum or not."""
    transfer = part.transfer
    first, *more = transfer.states
    if transfer.weights(part.output) != {first: fmpq(1)}:
        return False
    return all(abs(row[k]) == int(delta) for k, row in enumerate(transfer.matrix[1:], start=1)) and len(more) < 2


def _has_plain_inputs(part: Recursion) -> bool:
    """Whether each state takes the input with a weight that is a power of two."""
    weights = part.transfer.input_weights()
    return all(_is_power(abs(fraction(weight))) for weight in weights if weight)


def _is_power(value: Fraction) -> bool:
    numbers = value.numerator, value.denominator
    return all(number & (number - 1) == 0 for number in numbers)


def _is_allpass(part: Recursion) -> bool:
    """Whether a numerator is its denominator in reverse, but for a sign."""
    transfer = part.transfer
    if len(transfer.inputs) != 1:
        return False
    numerator = transfer.numerator(transfer.inputs[0], part.output).coeffs()
    reverse = transfer.denominator.coeffs()[::-1]
    return numerator in (reverse, [-value for value in reverse])
