"""Quantities of hardware that takes a sample of several channels at each clock, beside that of one channel."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from sosmith.gen.estimate.memories import of_memory
from sosmith.gen.estimate.quantities import Quantities, of_output_buffer, tree
from sosmith.gen.fpga.boards import Device
from sosmith.hdl.plan.decimating.plan import DecimatingPlan
from sosmith.hdl.plan.streams import channel_bits
from sosmith.model.dataflow.datapath import Datapath


def of_channels(plan: DecimatingPlan, datapath: Datapath, device: Device, widths: Sequence[int]) -> Quantities:
    """Count what is in front, what goes along with samples, and memories of so many bits for each channel."""
    if plan.channels == 1:
        return Counter()
    bits, (port,) = channel_bits(plan.channels), datapath.inputs
    kept = 2 + (plan.factor - 1).bit_length() + plan.settling.bit_length()
    along = bits + 1 + (plan.settling > 0)  # with each sample at each position
    made: Quantities = Counter(
        {
            "channels": bits,
            "logic": kept + 2 * tree(2 * bits) + bits,
            "registers": along * (plan.clocks + plan.limits) + bits + port.bits,
        }
    )
    for width in (kept, *filter(None, widths)):
        made += of_memory(device, plan.channels, width)
    return made + of_output_buffer(bits)
