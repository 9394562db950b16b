"""Quantities of hardware with one multiplier that takes the samples of an FIR filter from rings of memory."""

from __future__ import annotations

from collections import Counter

from sosmith.gen.architectures.folded_fir import FoldedFir
from sosmith.gen.estimate.graphs import clamp
from sosmith.gen.estimate.memories import of_memory, of_rom
from sosmith.gen.estimate.products import Product, of_product
from sosmith.gen.estimate.quantities import Quantities, flags_of, of_inputs
from sosmith.gen.fpga.boards import Device
from sosmith.gen.word_lengths.cost import Multiplication, Operand
from sosmith.hdl.plan.streams import channel_bits
from sosmith.model.dataflow.graph import Op

_CONTROL, _STATES = 75, 19
"""LUT4 and flip-flops of what moves samples and results, as synthesis of four cores for an ECP5 has them."""


def of_rings(architecture: FoldedFir, device: Device) -> Quantities:
    """Count the rings, the table of steps, the multiplier, the sum, and what moves samples."""
    plan, datapath = architecture.plan, architecture.datapath
    (port,), graph = datapath.inputs, datapath.stages[-1].graph
    channels, place = channel_bits(architecture.channels), (plan.words - 1).bit_length()
    rings, pair, factor = 1 + plan.pairs, plan.pair_bits(port), plan.factor_bits
    total = graph.nodes[graph.inputs[0]].width + 1
    made: Quantities = Counter(
        {"logic": _CONTROL, "registers": _STATES, "counters": place + plan.last_step.bit_length(), "channels": channels}
    )
    for _ in range(rings):
        made += of_memory(device, plan.words * architecture.channels, port.bits)
        made["sums"] += place
    codes = [(step.coefficient & ((1 << factor) - 1)) << place | step.first for step in plan.steps]
    made += of_rom(device, codes, factor + rings * place)
    made += of_product(Product(Multiplication(Operand(pair, signed=True), Operand(factor, signed=True))), device)
    made["sums"] += total + pair * plan.pairs
    made["registers"] += (
        pair + pair + factor + total + datapath.output.bits + flags_of(datapath) + 2 * port.bits * (channels > 0)
    )
    last = graph.nodes[graph.outputs[0]]
    if last.op is Op.CLAMP:
        made += clamp(last, graph.nodes[last.operands[0]])
    made += of_inputs(datapath.inputs, datapath.calibrated)
    made["compared"] += 2 * datapath.output.bits * bool(datapath.wear)
    if channels:
        made += of_memory(device, architecture.channels, 2 + place + datapath.samples_per_result.bit_length())
    return made
