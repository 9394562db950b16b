"""Quantities of an FIR filter that decimates, whose multipliers take turns with the phases of the samples."""

from __future__ import annotations

from collections import Counter

from sosmith.gen.architectures.polyphase import Polyphase
from sosmith.gen.estimate.decimating import of_channels
from sosmith.gen.estimate.graphs import clamp
from sosmith.gen.estimate.memories import of_rom
from sosmith.gen.estimate.products import Product, of_product
from sosmith.gen.estimate.quantities import Quantities, flags_of, of_inputs, of_output_buffer
from sosmith.gen.fpga.boards import Device
from sosmith.hdl.plan.decimating.polyphase import PolyphasePlan
from sosmith.model.dataflow.graph import Op


def of_polyphase(architecture: Polyphase, device: Device) -> Quantities:
    """Count the line, the multipliers with what chooses samples and coefficients, the sums, and the output."""
    plan, datapath = architecture.plan, architecture.datapath
    (port,), graph = datapath.inputs, datapath.stages[-1].graph
    count, total = plan.multipliers, graph.nodes[graph.inputs[0]].width + 1
    phase, pairs = (plan.factor - 1).bit_length(), plan.steps.pairs
    (size, *_) = architecture.multiplications
    made: Quantities = Counter(
        {
            "sums": count * (size.data.bits * pairs + total),
            "chosen": port.bits * _choices(plan) + total,
            "counters": 2 * phase + plan.fills.bit_length(),
            "logic": plan.clocks + 8,
            # The line; samples before each multiplier, and their sum; sums behind; what goes along with a sample.
            "registers": plan.length * port.bits
            + count * port.bits * (1 + pairs)
            + count * size.data.bits
            + (count - 1) * total
            + total
            + plan.clocks * (2 + phase),
        }
    )
    for _ in range(count):
        made += of_product(Product(size), device)
    made += of_rom(device, _rows(plan), count * plan.steps.factor_bits)
    last = graph.nodes[graph.outputs[0]]
    if last.op is Op.CLAMP:
        made += clamp(last, graph.nodes[last.operands[0]]) + Counter({"registers": last.width + 2})
    made["compared"] += 2 * datapath.output.bits * bool(datapath.wear)
    made += of_output_buffer(datapath.output.bits + flags_of(datapath))
    if plan.channels > 1:
        kept = (plan.length - 1) * port.bits
        made += of_channels(plan, datapath, device, [kept, total])
        # The line has those places alone that are taken; the rest counts as 0 for a first sample from zero.
        made["registers"] -= (plan.length - len(_places(plan))) * port.bits
        made["chosen"] += kept * (not plan.filled)
    return made + of_inputs(datapath.inputs, datapath.calibrated)


def _places(plan: PolyphasePlan) -> set[int]:
    """Return the places of the line that a multiplier takes."""
    taken = [(phase, step) for phase, own in enumerate(plan.by_phase) for step in own if step is not None]
    seconds = {step.second - phase for phase, step in taken if step.second is not None}
    return seconds | {step.first - phase for phase, step in taken}


def _choices(plan: PolyphasePlan) -> int:
    """Count the choices of two samples before all multipliers: one less than the places that each takes them from."""
    total = 0
    for k in range(plan.multipliers):
        taken = [(phase, own[k]) for phase, own in enumerate(plan.by_phase)]
        steps = [(phase, step) for phase, step in taken if step is not None]
        firsts = {step.first - phase for phase, step in steps}
        seconds = {step.second - phase for phase, step in steps if step.second is not None}
        total += len(firsts) - 1 + max(0, len(seconds) - 1)
    return total


def _rows(plan: PolyphasePlan) -> list[int]:
    """Return the coefficients of all multipliers, a word for each phase."""
    bits = plan.steps.factor_bits
    mask = (1 << bits) - 1
    return [
        sum((step.coefficient & mask) << bits * k for k, step in enumerate(own) if step is not None)
        for own in plan.by_phase
    ]
