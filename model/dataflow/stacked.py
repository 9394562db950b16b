"""Many datapaths of one structure computed at once, in exact integers: sets of constants for the same hardware.

To compile a C model takes longer than a short run of it. Where each of many sets is run over few samples, all of them
walk through the graph together, node by node, as 64-bit integers; a sample costs about as much as for one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph, Node, Op

Codes = npt.NDArray[np.int64]

MOST_BITS = 62
"""Width of a code from which on 64 bits might not hold what is aligned with it."""

_Step = Callable[[list[Codes]], Codes]


def compute_stacked(datapaths: Sequence[Datapath], codes: Codes) -> Codes:
    """Compute the output codes of each datapath for its own input codes, from reset, as `Datapath.compute` does.

    Parameters
    ----------
    datapaths : sequence of Datapath
        At least one; of the same structure: only constants and ranges may differ. Without a decimator.
    codes : integer array, shape (samples, datapaths, inputs)
        Input codes, each in its port's range.

    Returns
    -------
    int64 array, shape (samples, datapaths)
        Output codes.

    Raises
    ------
    ValueError
        If the structures differ, there is a decimator, or a code may be wider than `MOST_BITS`.
    """
    first = datapaths[0]
    if any(one.decimator is not None for one in datapaths):
        raise ValueError("datapaths must be without a decimator")
    if any(_structure(one) != _structure(first) for one in datapaths):
        raise ValueError("datapaths must be of one structure")
    stages = [_Stage([one.stages[k].graph for one in datapaths], codes.shape[1]) for k in range(len(first.stages))]
    result = np.empty(codes.shape[:2], dtype=np.int64)
    for n, sample in enumerate(np.moveaxis(codes.astype(np.int64), -1, 1)):
        wires = list(sample)
        for stage in stages:
            wires = stage.step(wires)
        result[n] = wires[0]
    return result


def _structure(datapath: Datapath) -> list[tuple[object, ...]]:
    return [
        (node.op, node.operands, node.frac, node.parameter_frac, node.parameter if node.op is Op.FRACTION else 0)
        for stage in datapath.stages
        for node in stage.graph.nodes
    ]


class _Stage:
    """The graphs of one stage in all datapaths, with their states."""

    def __init__(self, graphs: Sequence[Graph], count: int) -> None:
        self._graph = graphs[0]
        widest = max(node.width for graph in graphs for node in graph.nodes)
        if widest > MOST_BITS:
            raise ValueError(f"codes must be of at most {MOST_BITS} bits, not {widest}")
        self._state = {i: np.zeros(count, dtype=np.int64) for i in self._graph.delays}
        self._steps = [
            _step_of([graph.nodes[i] for graph in graphs], self._graph) for i in range(len(self._graph.nodes))
        ]

    def step(self, inputs: Sequence[Codes]) -> list[Codes]:
        """Compute one sample."""
        codes: list[Codes] = []
        supply = iter(inputs)
        for index, (node, step) in enumerate(zip(self._graph.nodes, self._steps, strict=True)):
            if node.op is Op.INPUT:
                codes.append(next(supply))
            elif node.op is Op.DELAY:
                codes.append(self._state[index])
            else:
                codes.append(step(codes))
        for index in self._state:
            self._state[index] = codes[self._graph.nodes[index].operands[0]]
        return [codes[i] for i in self._graph.outputs]


def _step_of(nodes: Sequence[Node], graph: Graph) -> _Step:
    """Return what computes a node in all datapaths from the codes before it."""
    node = nodes[0]
    own = np.array([one.parameter for one in nodes], dtype=np.int64)
    a, b = (*node.operands, 0, 0)[:2]
    fracs = [graph.nodes[i].frac if i >= 0 else 0 for i in node.operands]
    if node.op is Op.CONSTANT:
        return lambda codes: own
    if node.op is Op.SCALE:
        return lambda codes: codes[a] * own
    if node.op is Op.MULTIPLY:
        return lambda codes: codes[a] * codes[b]
    if node.op in {Op.ADD, Op.SUBTRACT}:
        up, down = node.frac - fracs[0], node.frac - fracs[1]
        if node.op is Op.ADD:
            return lambda codes: (codes[a] << up) + (codes[b] << down)
        return lambda codes: (codes[a] << up) - (codes[b] << down)
    return _step_of_one(nodes, a, fracs[0] if fracs else 0)


def _step_of_one(nodes: Sequence[Node], a: int, frac: int) -> _Step:
    """Do the same for an operation with one operand, of so many fraction bits, and no factor."""
    node, shift = nodes[0], frac - nodes[0].frac
    if node.op is Op.FLOOR:
        return lambda codes: codes[a] >> shift
    if node.op is Op.FRACTION:
        mask = (1 << (frac - node.parameter)) - 1
        return lambda codes: codes[a] & mask
    if node.op is Op.TRUNCATE:
        return lambda codes: np.where(codes[a] >= 0, codes[a] >> shift, -(-codes[a] >> shift))
    if node.op is Op.CLAMP:
        low, high = (np.array([getattr(one, end) for one in nodes], dtype=np.int64) for end in ("low", "high"))
        return lambda codes: np.clip(codes[a], low, high)
    return lambda codes: codes[a]
