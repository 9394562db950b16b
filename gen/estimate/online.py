"""Quantities of hardware whose sections work on signed digits."""

from __future__ import annotations

from collections import Counter

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.estimate.graphs import of_pipelined
from sosmith.gen.estimate.pipelined import Pipelined
from sosmith.gen.estimate.quantities import Quantities, flags_of, of_inputs, of_output_buffer
from sosmith.gen.fpga.boards import Device
from sosmith.gen.word_lengths.online_units import online_cost
from sosmith.model.sections.online import sections_of


def of_units(architecture: Architecture, device: Device) -> Quantities:
    """Count a core of the on-line architecture."""
    schedule, datapath = architecture.online, architecture.datapath
    assert schedule is not None
    made: Quantities = Counter()
    numbers = sections_of(datapath)
    for k, stage in enumerate(datapath.stages):
        if k not in numbers:
            made += of_pipelined(Pipelined.of_one(stage.graph, architecture.adders[k]), device)
    for section in schedule.sections:
        fed = bool(section.feedback)
        terms = len(section.numerator) + len(section.recursion) - 1
        made["residuals"] += schedule.units * section.residual_bits
        made["tables"] += schedule.units * section.residual_bits * -(-terms // 2)
        made["fed_back"] += (schedule.units + 1) * section.error_frac * len(section.feedback) * fed
        made["lines"] += schedule.units * schedule.interval
    made["units"] += schedule.units * len(schedule.sections)
    made["numbers"] += schedule.units * (schedule.input_bits + datapath.output.bits)
    made["registers"] += online_cost(datapath).register_bits
    made += of_inputs(datapath.inputs, datapath.calibrated)
    return made + of_output_buffer(datapath.output.bits + flags_of(datapath))
