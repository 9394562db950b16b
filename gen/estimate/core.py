"""Quantities of a core: of its stages, its program or its units, its decimator, and the shell around them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.cic import Cic
from sosmith.gen.architectures.folded_fir import FoldedFir
from sosmith.gen.architectures.multiplexed import Multiplexed
from sosmith.gen.architectures.polyphase import Polyphase
from sosmith.gen.architectures.shared_fir import SharedFir
from sosmith.gen.estimate.cic import of_cic
from sosmith.gen.estimate.graphs import of_pipelined, of_start
from sosmith.gen.estimate.memories import of_memory
from sosmith.gen.estimate.multiplexed import of_multiplexed
from sosmith.gen.estimate.online import of_units
from sosmith.gen.estimate.pipelined import Pipelined
from sosmith.gen.estimate.polyphase import of_polyphase
from sosmith.gen.estimate.programs import of_program
from sosmith.gen.estimate.quantities import (
    Quantities,
    check_bits,
    flags_of,
    of_check_bits,
    of_inputs,
    of_kept,
    of_output_buffer,
    tree,
)
from sosmith.gen.estimate.rings import of_rings
from sosmith.gen.fpga.boards import Device
from sosmith.hdl.plan.look_ahead import plans
from sosmith.hdl.plan.streams import channel_bits
from sosmith.hdl.plan.unfolding import unfolded_stages
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.decimator import Decimator
from sosmith.model.reload.constants import constants, with_room
from sosmith.model.sections.start import PassingStage, StartStage


def quantities_of(architecture: Architecture, device: Device) -> Quantities:
    """Count what a core is made of on a device, with its decimator and what stands before that."""
    if isinstance(architecture, SharedFir) and architecture.turn:
        return Counter()  # the first result has the hardware of all
    if architecture.online is not None:
        made = of_units(architecture, device)
    elif isinstance(architecture, FoldedFir):
        made = of_rings(architecture, device)
    elif isinstance(architecture, Cic):
        made = of_cic(architecture, device)
        made["counters"] += (architecture.copies_per_result - 1).bit_length()
    elif isinstance(architecture, Polyphase):
        made = of_polyphase(architecture, device)
        made["counters"] += (architecture.copies_per_result - 1).bit_length()
    elif isinstance(architecture, Multiplexed):
        made = of_multiplexed(architecture, device)
    elif architecture.program is not None:
        made = of_program(architecture, device)
    else:
        made = _of_stages(architecture, device)
    made["cores"] += 1
    if architecture.decimator is not None:
        made += _of_decimator(architecture, architecture.decimator, device)
        made += of_inputs(architecture.datapath.inputs, architecture.datapath.calibrated)
        if architecture.calibration is not None:
            made += quantities_of(architecture.calibration, device)
    return made


def _of_stages(architecture: Architecture, device: Device) -> Quantities:
    """Count a core whose every operation has its own hardware."""
    whole = with_room(architecture.datapath) if architecture.reload else architecture.datapath
    datapath, channels = whole.behind_decimator, channel_bits(architecture.channels)
    stages = _pipelined(architecture, datapath)
    made: Quantities = Counter()
    for start in _starts(architecture, datapath):
        made += of_start(start)
        made["registers"] += 2
    for stage in stages:
        made += of_pipelined(stage, device, protect=architecture.protect, loads=architecture.reload)
    made["guards"] += architecture.protect != "none"
    made["guarded_ports"] += architecture.has_registers and architecture.protect != "none"
    made["registers"] += (2 + channels) * sum(stage.depth for stage in stages)
    made += _of_shell(datapath, architecture)
    if architecture.reload:
        made += _of_constants(architecture)
    if channels:
        near = max(stage.distance for stage in stages) - 1
        made["channels"] += channels
        made["logic"] += near * tree(2 * channels)
        made["registers"] += near * (1 + channels)
        made += of_output_buffer(sum(port.bits for port in datapath.inputs) + channels)
    return made


def _pipelined(architecture: Architecture, datapath: Datapath) -> Sequence[Pipelined]:
    """Return the stages with their pipeline stages."""
    stages = unfolded_stages(datapath, architecture.samples_per_clock)
    if architecture.products is not None:
        return [Pipelined.of_turns(plan) for plan in plans(stages, architecture.products)]
    graphs = [(stage.graph, made) for stage, made in zip(stages, architecture.adders, strict=True)]
    if _starts(architecture, datapath):  # no stage passes the first sample on
        graphs = [
            ((stage.section if isinstance(stage, PassingStage) else stage).graph, made)
            for stage, made in zip(stages, architecture.adders, strict=True)
            if not isinstance(stage, StartStage)
        ]
    if architecture.channels == 1:
        return [Pipelined.of_one(graph, made) for graph, made in graphs]
    channels, rewrites = architecture.channels, architecture.protect != "none"
    return [Pipelined.of_channels(graph, channels, made, rewrites=rewrites) for graph, made in graphs]


def _starts(architecture: Architecture, datapath: Datapath) -> list[StartStage]:
    """Return the stages that keep the first sample in one place: those for one channel where no sample checks it."""
    several = architecture.channels > 1 or architecture.samples_per_clock > 1
    if several or architecture.look_ahead or architecture.protect != "none":
        return []
    return [stage for stage in datapath.stages if isinstance(stage, StartStage)]


def _of_shell(datapath: Datapath, architecture: Architecture) -> Quantities:
    lanes = architecture.samples_per_clock
    made: Quantities = Counter()
    if architecture.decimator is None:
        for _ in range(lanes):
            made += of_inputs(datapath.inputs, datapath.calibrated)
    flags = flags_of(datapath) + (architecture.protect != "none")
    made["compared"] += 2 * datapath.output.bits * bool(datapath.wear)
    return made + of_output_buffer((datapath.output.bits + flags) * lanes + channel_bits(architecture.channels))


def _of_constants(architecture: Architecture) -> Quantities:
    """Count the registers of constants that can be loaded, and what loads them."""
    loadable = constants(architecture.datapath)
    bits, words = sum(each.bits for each in loadable), sum(each.words for each in loadable)
    guarded = architecture.protect != "none"
    ports = {"ports": architecture.has_registers, "chosen": bits, "loaded": words}
    return Counter(ports | {"registers": 2 * bits, "parities": 2 * tree(bits) * guarded})


def _of_decimator(architecture: Architecture, decimator: Decimator, device: Device) -> Quantities:
    """Count integrators and combs, or the adder and memories of several channels, with their check bits."""
    width, bits, channels = decimator.width, decimator.output.bits, architecture.channels
    guarded, states = architecture.protect != "none", 2 * decimator.stages
    made: Quantities = Counter({"decimators": 1})
    made["sums"] += decimator.factor.bit_length() + (width if decimator.dropped else 0)
    marks = (decimator.stages + 1).bit_length() * guarded
    if channels == 1:
        made["sums"] += states * width + marks
        made["registers"] += decimator.register_bits + 2 * states + marks
        for _ in range(states * guarded):
            made += of_check_bits(width, "detect") + Counter({"registers": 1})
        return made + (of_kept(decimator.factor.bit_length()) if guarded else Counter())
    made["sums"] += width + marks
    made["chosen"] += 4 * width + decimator.input.bits
    made["channels"] += channel_bits(channels)
    made["registers"] += width + 2 * decimator.input.bits + bits
    kept, own = decimator.input.bits + decimator.factor.bit_length() + 1 + marks, "correct" if guarded else "none"
    made += of_check_bits(width, architecture.protect) + of_check_bits(kept, own)
    made += of_memory(device, channels << (states - 1).bit_length(), width + check_bits(width, architecture.protect))
    return made + of_memory(device, channels, kept + check_bits(kept, own))
