"""The stage that starts a filter from its first sample, as Rocq's `starts` knows it."""

from __future__ import annotations

from dataclasses import dataclass

from sosmith.verify.certificate_file import NodeEntry, Operation
from sosmith.verify.graph import inputs_of, require
from sosmith.verify.rocq.flat import FlatGraph


@dataclass(frozen=True)
class StartNodes:
    """Places of the nodes of such a stage in the whole graph.

    Attributes
    ----------
    sample, change, held : int
        The input, how much it differs from the first sample, and that.
    term : str
        All of them as a term of Rocq.
    span : int
        Largest difference of two samples.
    """

    sample: int
    change: int
    held: int
    term: str
    span: int


def start_of(graph: FlatGraph) -> StartNodes | None:
    """Find the nodes of the stage that starts a filter; None if there is no such stage.

    Raises
    ------
    RejectedError
        If there is one, and its nodes are not those that the theories know.
    """
    places = [index for index, stage in enumerate(graph.stages) if stage.role == "start"]
    if not places:
        return None
    stage, offset = graph.stages[places[0]], graph.offsets[places[0]]
    nodes = stage.nodes
    inputs = inputs_of(stage)
    require(len(inputs) == 1, f"a start must have one input, not {len(inputs)}")
    (sample,) = inputs
    change = stage.outputs[0]
    difference = _operand(nodes, change, Operation.BOUND)
    since, first = nodes[difference].operands if nodes[difference].op is Operation.SUBTRACT else (0, 0)
    held = _operand(nodes, first, Operation.DELAY)
    remainder = _operand(nodes, held, Operation.BOUND)
    factors = nodes[since].operands if nodes[since].op is Operation.MULTIPLY else (0, 0)
    started = next((at for at in factors if nodes[at].op is Operation.DELAY), 0)
    one = _operand(nodes, started, Operation.DELAY)
    chosen = (sample, started, one, first, since, difference, change, remainder, held)
    term = f"Start {' '.join(str(offset + at) for at in chosen)}"
    span = nodes[sample].high - nodes[sample].low
    return StartNodes(offset + sample, offset + change, offset + held, term, span)


def _operand(nodes: tuple[NodeEntry, ...], at: int, op: Operation) -> int:
    require(nodes[at].op is op, f"a start must have a {op.value} at its node {at}, not a {nodes[at].op.value}")
    return nodes[at].operands[0]
