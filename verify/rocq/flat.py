"""The graphs of a certificate's stages as one graph, and its nodes as terms of Rocq."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

from sosmith.verify.certificate_file import Certificate, NodeEntry, Operation, StageEntry
from sosmith.verify.graph import inputs_of, label, require
from sosmith.verify.rocq.polynomials import number


@dataclass(frozen=True)
class FlatGraph:
    """All stages' nodes in a row.

    Attributes
    ----------
    stages : sequence of StageEntry
    offsets : list of int
        Place of the first node of each stage, and behind them the number of all nodes.
    feeds : list of list of int
        For each stage but the first one, the nodes that its inputs take, in order. What stages only pass on, without
        using it, is taken from where it comes from.
    ports : list of pairs of int
        Ranges of the inputs of the first stage.
    """

    stages: Sequence[StageEntry]
    offsets: list[int]
    feeds: list[list[int]]
    ports: list[tuple[int, int]]

    @property
    def size(self) -> int:
        """Number of nodes."""
        return self.offsets[-1]

    def node(self, index: int) -> NodeEntry:
        """Return a node by its place in the whole graph."""
        stage, at = self._at(index)
        return self.stages[stage].nodes[at]

    def fed_by(self, index: int) -> int:
        """Return the node that an input of a later stage takes."""
        stage, at = self._at(index)
        return self.feeds[stage][inputs_of(self.stages[stage]).index(at)]

    def _at(self, index: int) -> tuple[int, int]:
        stage = bisect_right(self.offsets, index) - 1
        return stage, index - self.offsets[stage]

    def term(self) -> str:
        """Write it as a list of nodes."""
        rows = []
        for index, stage in enumerate(self.stages):
            entries = inputs_of(stage)
            for at, node in enumerate(stage.nodes):
                if node.op is Operation.INPUT:
                    place = entries.index(at)
                    made = f"Wire {self.feeds[index][place]}" if index else f"Input {place}"
                else:
                    made = _operation(node, self.offsets[index])
                rows.append(f"Node ({made}) {number(node.frac)} {number(node.low)} {number(node.high)}")
        return "[" + ";\n   ".join(rows) + "]"

    def layout(self) -> str:
        """Write the number of nodes and the outputs of each stage, as the certificate has them."""
        stages = (f"({len(stage.nodes)}, [{'; '.join(map(str, stage.outputs))}])" for stage in self.stages)
        return f"[{'; '.join(stages)}]%nat"

    def check(self) -> None:
        """Check what the theorems of a well-formed graph say, where no other theorem can be written without it.

        Raises
        ------
        RejectedError
            If an operand or an output is no node of its stage, or a node drops no bit where it must.
        """
        for stage in self.stages:
            _check_places(stage)
            _check_drops(stage)


def flattened(certificate: Certificate) -> FlatGraph:
    """Put all stages in a row.

    Raises
    ------
    RejectedError
        If a node has not as many operands as its operation takes, or a stage not as many inputs as the one before it
        has outputs, or the first one as there are. That operands and outputs are nodes of their stages is not asked.
    """
    offsets: list[int] = [0]
    feeds: list[list[int]] = [[]]
    for index, stage in enumerate(certificate.stages):
        _check_counts(stage)
        if index:
            before = certificate.stages[index - 1]
            taken = [_origin(before, output, offsets[-2], feeds[-1]) for output in before.outputs]
            count = len(inputs_of(stage))
            require(count == len(taken), f"{stage.name} must have {len(taken)} inputs, not {count}")
            feeds.append(taken)
        offsets.append(offsets[-1] + len(stage.nodes))
    return FlatGraph(certificate.stages, offsets, feeds, _ports(certificate))


def _origin(stage: StageEntry, output: int, offset: int, feeds: Sequence[int]) -> int:
    """Return the node that an output of a stage comes from: of an earlier stage, if this one only passes it on."""
    inputs = inputs_of(stage)
    if feeds and output in set(inputs) - set(used_inputs(stage)):
        return feeds[inputs.index(output)]
    return offset + output


def used_inputs(stage: StageEntry) -> list[int]:
    """Return the inputs that a stage computes with, not those that only pass beside it."""
    used = {operand for node in stage.nodes for operand in node.operands}
    return [at for at in inputs_of(stage) if at in used]


def _check_counts(stage: StageEntry) -> None:
    """Check that nodes have as many operands as their operations take."""
    for index, node in enumerate(stage.nodes):
        count = {Operation.INPUT: 0, Operation.CONSTANT: 0, **dict.fromkeys(_TWO, 2)}.get(node.op, 1)
        found = len(node.operands)
        require(found == count, f"{label(stage, index)} must have {count} operands, not {found}")


def _check_places(stage: StageEntry) -> None:
    """Check that operands and outputs are nodes of the stage."""
    for index, node in enumerate(stage.nodes):
        last = len(stage.nodes) if node.op is Operation.DELAY else index
        places = node.operands
        require(max(places, default=-1) < last, f"{label(stage, index)} must have operands before it, not {places}")
    outputs = stage.outputs
    require(max(outputs) < len(stage.nodes), f"outputs of {stage.name} must be nodes of it, not {outputs}")


def _check_drops(stage: StageEntry) -> None:
    """Check that what rounds drops bits."""
    for index, node in enumerate(stage.nodes):
        if node.op in _DROPPING:
            kept = node.parameter if node.op is Operation.FRACTION else node.frac
            dropped = stage.nodes[node.operands[0]].frac - kept
            require(dropped > 0, f"{label(stage, index)} must drop at least one bit, not {dropped}")


_DROPPING = (Operation.FLOOR, Operation.FRACTION, Operation.TRUNCATE)
_TWO = (Operation.ADD, Operation.SUBTRACT, Operation.MULTIPLY)


def _ports(certificate: Certificate) -> list[tuple[int, int]]:
    """Return the ranges of the inputs: of the certificate's own, or of what a decimator hands on."""
    first = certificate.stages[0]
    entries = [first.nodes[index] for index in inputs_of(first)]
    if certificate.decimation is not None:
        return [(entry.low, entry.high) for entry in entries]
    require(
        len(entries) == len(certificate.inputs),
        f"{first.name} must have {len(certificate.inputs)} inputs, not {len(entries)}",
    )
    return [(port.lowest, port.highest) for port in certificate.inputs]


_NAMES = {
    Operation.ADD: "Add",
    Operation.SUBTRACT: "Subtract",
    Operation.MULTIPLY: "Multiply",
    Operation.FLOOR: "Floor",
    Operation.TRUNCATE: "Truncate",
    Operation.CLAMP: "Clamp",
    Operation.BOUND: "Bound",
    Operation.DELAY: "Delay",
}


def _operation(node: NodeEntry, offset: int) -> str:
    operands = [str(offset + i) for i in node.operands]
    if node.op is Operation.CONSTANT:
        return f"Constant {number(node.parameter)}"
    if node.op is Operation.SCALE:
        return f"Scale {operands[0]} {number(node.parameter)} {number(node.parameter_frac)}"
    if node.op is Operation.SHIFT:
        return f"Shift {operands[0]} {number(node.parameter)}"
    if node.op is Operation.FRACTION:
        return f"Fraction {operands[0]} {number(node.parameter)}"
    return " ".join([_NAMES[node.op], *operands])
