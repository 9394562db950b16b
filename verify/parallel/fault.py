"""Says which node is wrong in hardware that was rejected.

Nets and registers have names of nodes. The first, in the order of the graph, that does not hold the code of its node is
named; the names are a guess, for the sentence of a rejection only.
"""

from __future__ import annotations

import re

from sosmith.verify.graph import RejectedError
from sosmith.verify.parallel.graph_codes import GraphCodes
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.parallel.pipeline import Pipeline


def fault(netlist: Netlist, pipeline: Pipeline, graph: GraphCodes) -> RejectedError | None:
    """Return the rejection for the first net that does not hold the code of the node it is named after, if any."""
    for index, node in enumerate(graph.nodes):
        if not node.entry.name and (len(graph.lanes) > 1 or graph.turned):
            continue  # named by a number, which is that of another node in the hardware
        own = re.compile(rf"{re.escape(graph.state_name(index))}(_passed\d+|_register)?")
        for name in sorted(filter(own.fullmatch, netlist.widths), key=lambda name: (len(name), name)):
            try:
                code = pipeline.computed(name)
                right = code is None or pipeline.same(code, graph.codes[index], netlist.widths[name])
            except RejectedError as error:
                sentence = str(error)
                named = node.label in sentence or "node " in sentence
                return error if named else RejectedError(f"{name} must be {node.label}, but {sentence}")
            if not right:
                return RejectedError(f"{name} must be {node.label}, not another value")
    return None
