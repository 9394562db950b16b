"""A certificate's graphs as one: what each node is in terms of inputs and states, and where these go.

The stages are joined, the inputs of each being the outputs of the one before. A node's value is then a normal form
(`sosmith.verify.program.normal_form`) of the codes of the inputs and of the DELAY nodes at the same sample.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from types import MappingProxyType

from sosmith.verify.certificate_file import Certificate, NodeEntry, Operation
from sosmith.verify.graph import label, require
from sosmith.verify.program.normal_form import Form, Forms, constant, plus, scaled, times

NO_FLOORS: Mapping[int, int] = MappingProxyType({})


@dataclass(frozen=True)
class GraphNode:
    """A node of the joined graph.

    Attributes
    ----------
    entry : NodeEntry
        The node; its operands are indices in the joined graph.
    label : str
        Its name in messages.
    name : str
        Its name behind that of its stage; its number in the joined graph, if it has none.
    """

    entry: NodeEntry
    label: str
    name: str

    @property
    def limits(self) -> tuple[Fraction, Fraction]:
        """Range of its value."""
        unit = Fraction(2) ** -self.entry.frac
        return self.entry.low * unit, self.entry.high * unit


@dataclass(frozen=True)
class Graph:
    """All stages of a certificate.

    Attributes
    ----------
    nodes : tuple of GraphNode
        The nodes; an operand that is a DELAY may be computed later.
    inputs : tuple of int
        Inputs, in the order of the ports.
    delays : tuple of int
        The DELAY nodes.
    output : int
        The output before it is limited to the port's range.
    settling : int or None
        What is negative for the samples that are flagged as settling; None without the flag.
    """

    nodes: tuple[GraphNode, ...]
    inputs: tuple[int, ...]
    delays: tuple[int, ...]
    output: int
    settling: int | None = None

    def values(self, forms: Forms, floors: Mapping[int, int] = NO_FLOORS) -> list[Form]:
        """Return the value of each node as a form of the variables ``("node", index)``: inputs and delays.

        A delay in `floors` has no variable: it is the floor of another one, to its own fraction bits.
        """

        def variable(index: int) -> Form:
            entry = self.nodes[index].entry
            if index in floors:
                return floored(variable(floors[index]), entry.frac, forms)
            return scaled(forms.variable(("node", index), entry.low, entry.high), -entry.frac)

        values: list[Form] = []
        for index, node in enumerate(self.nodes):
            entry = node.entry
            if entry.op in {Operation.INPUT, Operation.DELAY}:
                values.append(variable(index))
            else:
                values.append(_value(entry, [values[i] for i in entry.operands], forms))
        return values

    def step(self, codes: Sequence[int], states: dict[int, int]) -> int:
        """Compute a sample from input codes, and the codes of the states; return the output and update the states."""
        values: list[int] = []
        supply = iter(codes)
        for index, node in enumerate(self.nodes):
            if node.entry.op is Operation.INPUT:
                values.append(next(supply))
            elif node.entry.op is Operation.DELAY:
                values.append(states[index])
            else:
                operands = [(values[i], self.nodes[i].entry.frac) for i in node.entry.operands]
                values.append(_code(node.entry, operands))
        for index in self.delays:
            states[index] = values[self.nodes[index].entry.operands[0]]
        return values[self.output]


def joined(certificate: Certificate) -> Graph:
    """Join the stages of a certificate that `verify` has accepted.

    Raises
    ------
    RejectedError
        If a node has an operation that a program cannot have.
    """
    nodes: list[GraphNode] = []
    inputs: list[int] = []
    passed: list[int] = []
    for stage in certificate.stages:
        supply = iter(passed)
        at: list[int] = []
        start = len(nodes)
        for index, entry in enumerate(stage.nodes):
            if entry.op is Operation.INPUT and passed:
                at.append(next(supply))
                continue
            at.append(len(nodes))
            name = f"{stage.name}.{entry.name}" if entry.name else f"value{len(nodes)}"
            nodes.append(GraphNode(entry, label(stage, index), name))
        for i in range(start, len(nodes)):
            entry = nodes[i].entry
            moved = entry.model_copy(update={"operands": tuple(at[k] for k in entry.operands)})
            nodes[i] = replace(nodes[i], entry=moved)
        if not passed:
            inputs = [i for i, node in enumerate(nodes) if node.entry.op is Operation.INPUT]
        passed = [at[i] for i in stage.outputs]
    output, *flags = passed
    if nodes[output].entry.op is Operation.CLAMP and output == len(nodes) - 1:
        (output,) = nodes.pop().entry.operands
    for node in nodes:
        require(
            node.entry.op not in {Operation.CLAMP, Operation.TRUNCATE},
            f"{node.label} must not be inside a graph that a program computes",
        )
    delays = tuple(i for i, node in enumerate(nodes) if node.entry.op is Operation.DELAY)
    return Graph(tuple(nodes), tuple(inputs), delays, output, *flags)


def floored(form: Form, kept: int, forms: Forms) -> Form:
    """Return the floor of a form to `kept` fraction bits."""
    return scaled(forms.floor(scaled(form, kept)), -kept)


def _value(entry: NodeEntry, operands: Sequence[Form], forms: Forms) -> Form:
    if entry.op is Operation.CONSTANT:
        return constant(entry.parameter * Fraction(2) ** -entry.frac)
    if entry.op in {Operation.ADD, Operation.SUBTRACT}:
        a, b = operands
        return plus(a, b, 1 if entry.op is Operation.ADD else -1)
    if entry.op is Operation.MULTIPLY:
        return times(*operands)
    (of,) = operands
    if entry.op is Operation.SHIFT:
        return scaled(of, entry.parameter)
    if entry.op is Operation.SCALE:
        return times(of, constant(entry.parameter * Fraction(2) ** -entry.parameter_frac))
    if entry.op is Operation.FLOOR:
        return floored(of, entry.frac, forms)
    if entry.op is Operation.FRACTION:
        return plus(of, floored(of, entry.parameter, forms), -1)
    return of  # BOUND


def _code(entry: NodeEntry, operands: Sequence[tuple[int, int]]) -> int:
    """Code of a node from the codes and fraction bits of its operands."""
    if entry.op is Operation.CONSTANT:
        return entry.parameter
    if entry.op in {Operation.ADD, Operation.SUBTRACT}:
        a, b = (code << (entry.frac - frac) for code, frac in operands)
        return a + b if entry.op is Operation.ADD else a - b
    (code, frac), *others = operands
    if entry.op is Operation.MULTIPLY:
        return code * others[0][0]
    if entry.op is Operation.SCALE:
        return code * entry.parameter
    if entry.op is Operation.FLOOR:
        return code >> (frac - entry.frac)
    if entry.op is Operation.FRACTION:
        return code & ((1 << (frac - entry.parameter)) - 1)
    return code  # SHIFT, BOUND
