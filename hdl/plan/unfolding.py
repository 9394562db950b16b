"""Several samples a clock: a graph unfolded into lanes, each of which computes one sample of every beat.

A delay is the value of the lane before, and a register only from the last lane back to the first::

    lane 0    x(4n)   -----> + -----> v(4n)   --> y        v(n) = x(n) + floor(v(n-1) / 2)
                             ^          |
              [v] --floor(/2)+   floor(/2)
               ^                        v
    lane 1    x(4n+1) ----------------> + --> v(4n+1) --> y
               |                                 .. and so on; the last lane's v is held for the next beat
               +--------------------------------

Every node is computed with the same integers as before, so that the results are the same bit for bit.

>>> from sosmith.model.dataflow.graph import GraphBuilder
>>> g = GraphBuilder()
>>> x = g.input("x", 0, 0, 7)
>>> graph = g.build([g.add(x, g.previous(x, "before"))])
>>> graph.run([[1], [2], [3], [4]]), unfolded(graph, 2).run([[1, 2], [3, 4]])
([[1], [3], [5], [7]], [[1, 3], [5, 7]])
"""

from __future__ import annotations

from dataclasses import dataclass

from sosmith.hdl.plan.reassociation import reassociated
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Op, Wire
from sosmith.model.dataflow.structure import Stage


@dataclass(frozen=True)
class UnfoldedStage:
    """A stage of a datapath that computes several samples at once: the ports of the first one come first."""

    name: str
    graph: Graph


def unfolded_stages(datapath: Datapath, lanes: int) -> tuple[Stage, ...]:
    """Return the stages of a datapath for so many samples a clock."""
    if lanes == 1:
        return datapath.stages
    graphs = (reassociated(unfolded(stage.graph, lanes)) for stage in datapath.stages)
    return tuple(UnfoldedStage(stage.name, graph) for stage, graph in zip(datapath.stages, graphs, strict=True))


def unfolded(graph: Graph, lanes: int) -> Graph:
    """Return a graph that computes `lanes` samples at a time; its ports are those of the first sample, and so on."""
    if lanes == 1:
        return graph
    g = GraphBuilder()
    before: list[Wire] = []
    states: dict[int, Wire] = {}
    outputs: list[Wire] = []
    for lane in range(lanes):
        wires: list[Wire] = []
        for index, node in enumerate(graph.nodes):
            named = node._replace(name=f"{node.name}_{lane}" if node.name else "")
            if node.op is not Op.DELAY:
                wires.append(g.copied(named, [wires[i] for i in node.operands]))
            elif lane:
                wires.append(before[node.operands[0]])
            else:
                states[index] = g.copied(named, [])
                wires.append(states[index])
        outputs += [wires[i] for i in graph.outputs]
        before = wires
    for index, wire in states.items():
        g.connect(wire, before[graph.nodes[index].operands[0]])
    return g.build(outputs)
