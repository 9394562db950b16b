"""A stage of a certificate for several samples a clock: lane 0 computes the first sample of each beat, lane 1 the next.

What a DELAY remembers is what its operand was in the lane before. Only in lane 0 that is of the beat before, where it
was computed in the last lane::

    lane 0     v(2n)                 DELAY in lane 0 = v in lane 1, a beat ago
    lane 1     v(2n+1)               DELAY in lane 1 = v in lane 0

So all that is said of samples holds of beats, with a graph of more nodes.
"""

from __future__ import annotations

from dataclasses import dataclass

from sosmith.verify.certificate_file import NodeEntry, Operation, StageEntry
from sosmith.verify.graph import label


@dataclass(frozen=True)
class LaneNode:
    """A node of a stage in one of its lanes.

    Attributes
    ----------
    entry : NodeEntry
        The node; its operands are those of its stage.
    operands : tuple of int
        Its operands among the nodes of all lanes.
    name : str
        Its name in the hardware, which may be missing or taken.
    label : str
        Its name in messages.
    remembered : bool
        Whether the next lane or a DELAY takes over its code.
    """

    entry: NodeEntry
    operands: tuple[int, ...]
    name: str
    label: str
    remembered: bool = False


def in_lanes(stage: StageEntry, lanes: int) -> tuple[list[LaneNode], list[int]]:
    """Return the nodes of a stage in all lanes, lane by lane, and its outputs among them likewise."""
    if lanes == 1:
        nodes = [
            LaneNode(node, node.operands, node.name, label(stage, index)) for index, node in enumerate(stage.nodes)
        ]
        return nodes, list(stage.outputs)
    numbers: dict[tuple[int, int], int] = {}
    for lane in range(lanes):
        for index, node in enumerate(stage.nodes):
            if node.op is not Operation.DELAY or lane == 0:
                numbers[index, lane] = len(numbers)

    def place(index: int, lane: int) -> int:
        while (index, lane) not in numbers:  # a DELAY: in lane 0, all nodes are
            (index,), lane = stage.nodes[index].operands, lane - 1
        return numbers[index, lane]

    delayed = {node.operands[0] for node in stage.nodes if node.op is Operation.DELAY}
    remembered = {place(k, lane) for k in delayed for lane in range(lanes)}
    nodes = []
    for (index, lane), number in numbers.items():
        node = stage.nodes[index]
        before = lanes - 1 if node.op is Operation.DELAY else lane
        operands = tuple(place(k, before) for k in node.operands)
        name = f"{node.name}_{lane}" if node.name else ""
        text = f"{label(stage, index)} in lane {lane}"
        nodes.append(LaneNode(node, operands, name, text, number in remembered))
    return nodes, [place(k, lane) for lane in range(lanes) for k in stage.outputs]
