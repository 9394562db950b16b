"""Quantities of hardware that has an adder for each integrator and each comb of a CIC filter."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

from sosmith.gen.architectures.cic import Cic
from sosmith.gen.estimate.decimating import of_channels
from sosmith.gen.estimate.graphs import clamp
from sosmith.gen.estimate.quantities import Quantities, flags_of, of_inputs, of_output_buffer
from sosmith.gen.fpga.boards import Device
from sosmith.model.dataflow.graph import Op


class Ladder(NamedTuple):
    """What determines how large the hardware is, but for the limits of its output.

    Attributes
    ----------
    order, width : int
        Integrators and as many combs, and bits of each.
    factor : int
        Samples for each result.
    rounded_bits, output_bits : int
        Bits of the last difference above what rounding leaves out, and of a result.
    flags : int
        Flags of a result.
    """

    order: int
    width: int
    factor: int
    rounded_bits: int
    output_bits: int
    flags: int


def of_cic(architecture: Cic, device: Device) -> Quantities:
    """Count integrators, combs, the output, what looks at the input, and the memories of several channels."""
    plan, datapath = architecture.plan, architecture.datapath
    graph = datapath.stages[-1].graph
    last = graph.nodes[graph.outputs[0]]
    unlimited = graph.nodes[last.operands[0]] if plan.limits else last
    made = of_ladder(
        Ladder(plan.order, plan.width, plan.factor, unlimited.width, datapath.output.bits, flags_of(datapath))
    )
    if last.op is Op.CLAMP:
        made += clamp(last, unlimited) + Counter({"registers": last.width + 2})
    if plan.channels > 1:
        made += of_channels(plan, datapath, device, [plan.width] * 2 * plan.order)
        made["registers"] -= plan.order * plan.width  # a comb leaves what it remembers to its memory
        made["chosen"] += 2 * plan.order * plan.width * (not plan.filled)  # 0 for a first sample from zero
    made["compared"] += 2 * datapath.output.bits * bool(datapath.wear)
    return made + of_inputs(datapath.inputs, datapath.calibrated)


def of_ladder(ladder: Ladder) -> Quantities:
    """Count all but the limits of the output, and what looks at the input."""
    phase, order = (ladder.factor - 1).bit_length(), ladder.order
    made: Quantities = Counter(
        {
            "sums": 2 * order * ladder.width + ladder.rounded_bits,
            "counters": phase + 2 * order.bit_length(),
            "logic": 2 * order + 4,
            # Integrators; what combs remember and give; valid bits, which samples bring results, and the flag of rails.
            "registers": 3 * order * ladder.width + ladder.rounded_bits + 5 * order + phase + 6,
        }
    )
    return made + of_output_buffer(ladder.output_bits + ladder.flags)
