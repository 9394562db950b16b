"""Quantities of hardware that has every operation of a dataflow graph, in pipeline stages."""

from __future__ import annotations

from collections import Counter

from sosmith.gen.estimate.memories import of_memory
from sosmith.gen.estimate.pipelined import SUMS, Pipelined
from sosmith.gen.estimate.products import of_product, product_in
from sosmith.gen.estimate.quantities import Quantities, check_bits, of_check_bits, tree
from sosmith.gen.estimate.sums import of_sums
from sosmith.gen.fpga.boards import Device
from sosmith.model.dataflow.graph import Graph, Node, Op
from sosmith.model.sections.start import StartStage


def of_pipelined(plan: Pipelined, device: Device, *, protect: str = "none", loads: bool = False) -> Quantities:
    """Count a stage on a device; `loads` says that its constants come from registers."""
    graph, made = plan.graph, of_sums(plan)
    for index, node in enumerate(graph.nodes):
        if node.op is Op.DELAY:
            made += _state(plan, index, device, protect)
        elif index not in plan.adders and node.op not in SUMS:
            made += _operation(graph, node, device, loads=loads)
        if node.op not in {Op.CONSTANT, Op.SHIFT}:
            made["registers"] += plan.used[index] * plan.passes(index)
    made["registers"] += sum(graph.nodes[i].width for i in graph.outputs if not plan.is_state(i)) + 2 * plan.depth
    made["guarded_stages"] += plan.depth * (protect != "none")
    return made


def of_start(stage: StartStage) -> Quantities:
    """Count what takes the first sample off every sample, and keeps it in one place."""
    graph = stage.graph
    change = graph.nodes[graph.outputs[0]].width
    states = sum(graph.nodes[i].width for i in graph.delays)
    return Counter({"sums": change, "logic": len(graph.delays), "registers": change + states + 2})


def _operation(graph: Graph, node: Node, device: Device, *, loads: bool) -> Quantities:
    nodes = graph.nodes
    if graph.is_gate(node):
        return Counter({"gated": node.width})
    if node.op is Op.TRUNCATE:
        return Counter({"sums": nodes[node.operands[0]].width})
    if node.op is Op.CLAMP:
        return clamp(node, nodes[node.operands[0]])
    product = product_in(graph, node, loads=loads)
    return Counter() if product is None else of_product(product, device)


def clamp(node: Node, operand: Node) -> Quantities:
    """Count what limits a value to a range: a choice for each bit, and a comparison with its ends."""
    bits = node.high.bit_length()
    simple = node.high == (1 << bits) - 1 and node.low in {0, -node.high - 1}
    ends = 2 * tree(max(0, operand.width - bits)) if simple else 0
    return Counter({"chosen": node.width, "logic": ends, "compared": 0 if simple else 2 * operand.width})


def _state(plan: Pipelined, index: int, device: Device, protect: str) -> Quantities:
    graph = plan.graph
    width = graph.nodes[index].width
    if index in plan.held:
        return _held_state(plan, width, device, protect)
    early = any(
        plan.stages[user] < plan.stages[index]
        for user, node in enumerate(graph.nodes)
        if index in node.operands and node.op is not Op.DELAY
    )
    made: Quantities = Counter({"registers": width, "chosen": width * early})
    if protect != "none":  # registers have parity
        made += of_check_bits(width, "detect") + Counter({"registers": 1})
    return made


def _held_state(plan: Pipelined, width: int, device: Device, protect: str) -> Quantities:
    whole = width + check_bits(width, protect)
    if plan.words_in_registers:
        made: Quantities = Counter({"muxed": whole, "registers": plan.words * whole})
    else:
        made = of_memory(device, plan.words, whole, block=plan.block_ram)
        made += Counter({"registers": width * plan.block_ram, "states": width})
    if protect == "none":
        return made
    return made + of_check_bits(width, protect) + Counter({"chosen": width})  # a scrub writes what it has read
