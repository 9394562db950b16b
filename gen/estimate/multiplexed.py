"""Quantities of a core whose sections share hardware."""

from __future__ import annotations

from collections import Counter

from sosmith.gen.architectures.multiplexed import Multiplexed
from sosmith.gen.estimate.graphs import of_pipelined, of_start
from sosmith.gen.estimate.pipelined import Pipelined
from sosmith.gen.estimate.quantities import Quantities, flags_of, of_inputs, of_output_buffer
from sosmith.gen.fpga.boards import Device
from sosmith.hdl.plan.sharing.sections import SharedSections
from sosmith.model.sections.start import StartStage


def of_multiplexed(architecture: Multiplexed, device: Device) -> Quantities:
    """Count the stages with hardware of their own, the shared ones, and what chooses between sections."""
    plan, datapath = architecture.plan, architecture.datapath
    made: Quantities = Counter({"registers": 2 * plan.depth, "counters": (plan.interval - 1).bit_length()})
    for unit in plan.units:
        if isinstance(unit, SharedSections):
            made += _of_shared(unit, plan.clocks, device)
        elif isinstance(unit, StartStage):
            made += of_start(unit) + Counter({"registers": 2})
        else:
            made += of_pipelined(Pipelined.of_one(unit.graph, ()), device)
    if plan.is_kept_at_entrance:
        made["registers"] += sum(port.bits for port in datapath.inputs)
    made["compared"] += 2 * datapath.output.bits * bool(datapath.wear)
    made += of_output_buffer(datapath.output.bits + flags_of(datapath))
    return made + of_inputs(datapath.inputs, datapath.calibrated)


def _of_shared(unit: SharedSections, clocks: int, device: Device) -> Quantities:
    """Count sections that share hardware: places of the states of all but one beside what one of them has."""
    graph, count = unit.graph, len(unit.stages)
    made = of_pipelined(Pipelined.of_turn(unit, clocks), device)
    made["registers"] += (count - 1) * unit.state_bits
    made["counters"] += (count - 1).bit_length()
    made["chosen"] += graph.nodes[graph.inputs[0]].width
    changing = sum(max(each).bit_length() for each in unit.constants.values() if len(set(each)) > 1)
    made["registers"] += changing + 1
    made["logic"] += changing // 2 + count
    return made
