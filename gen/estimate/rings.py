"""Quantities of hardware with one multiplier that takes the samples of an FIR filter from rings of memory."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from sosmith.gen.architectures.folded_fir import FoldedFir
from sosmith.gen.estimate.graphs import clamp
from sosmith.gen.estimate.memories import of_memory, of_rom
from sosmith.gen.estimate.products import Product, of_product
from sosmith.gen.estimate.quantities import (
    Quantities,
    check_bits,
    flags_of,
    of_check_bits,
    of_inputs,
    of_kept,
    parity,
)
from sosmith.gen.fpga.boards import Device
from sosmith.gen.word_lengths.cost import Multiplication, Operand
from sosmith.hdl.plan.streams import channel_bits
from sosmith.model.dataflow.graph import Op

_CONTROL, _STATES = 75, 19
"""LUT4 and flip-flops of what moves samples and results, as synthesis of four cores for an ECP5 has them."""


class Rings(NamedTuple):
    """What determines how large the hardware is, but for the limits of its output.

    Attributes
    ----------
    words, data_bits : int
        Samples that a ring holds, and bits of one.
    pair_bits, pairs : int
        Bits of the sum of two samples, or of one, and whether samples are added in pairs.
    factor_bits, sum_bits : int
        Bits of a coefficient, and of the sum of all products.
    output_bits, flags : int
        Bits and flags of a result.
    channels : int
    last_step : int
        Number of the clock at which the sum is complete.
    codes : sequence of int
        The words of the table of steps.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`.
    """

    words: int
    data_bits: int
    pair_bits: int
    pairs: bool
    factor_bits: int
    sum_bits: int
    output_bits: int
    flags: int
    channels: int
    last_step: int
    codes: Sequence[int]
    protect: str = "none"


def of_rings(architecture: FoldedFir, device: Device) -> Quantities:
    """Count the rings, the table of steps, the multiplier, the sum, and what moves samples."""
    datapath = architecture.datapath
    plan = architecture.in_turn
    (port,), graph = datapath.inputs, datapath.stages[-1].graph
    place, factor = (plan.words - 1).bit_length(), plan.factor_bits
    rings = Rings(
        words=plan.words,
        data_bits=port.bits,
        pair_bits=plan.data_bits,
        pairs=plan.pairs,
        factor_bits=factor,
        sum_bits=graph.nodes[graph.inputs[0]].width + 1,
        output_bits=datapath.output.bits,
        flags=flags_of(datapath),
        channels=architecture.channels,
        last_step=sum(last + 1 for last in plan.last_steps) - 1,
        codes=[(step.coefficient & ((1 << factor) - 1)) << place | step.first for own in plan.rounds for step in own],
        protect=architecture.protect,
    )
    made = of_size(rings, device)
    last = graph.nodes[graph.outputs[0]]
    if last.op is Op.CLAMP:
        made += clamp(last, graph.nodes[last.operands[0]])
    made += of_inputs(datapath.inputs, datapath.calibrated)
    made["compared"] += 2 * datapath.output.bits * bool(datapath.wear)
    kept, guarded = 2 + place + datapath.samples_per_result.bit_length(), architecture.protect != "none"
    made["guarded_ports"] += guarded and architecture.reload
    if rings.channels > 1:
        own = "correct" if guarded else "none"
        return made + of_memory(device, rings.channels, kept + check_bits(kept, own)) + of_check_bits(kept, own)
    return made + (of_kept(kept) if guarded else Counter())


def of_size(rings: Rings, device: Device) -> Quantities:
    """Count all but the limits of the output, what looks at the input, and the places of several channels."""
    channels, place = channel_bits(rings.channels), (rings.words - 1).bit_length()
    factor, count = rings.factor_bits, 1 + rings.pairs
    row = factor + count * place
    made: Quantities = Counter(
        {
            "logic": _CONTROL,
            "registers": _STATES,
            "counters": place + rings.last_step.bit_length(),
            "channels": channels,
        }
    )
    for ring in range(count):
        word = rings.data_bits + check_bits(rings.data_bits, rings.protect)
        made += of_memory(device, rings.words * rings.channels, word)
        made += of_check_bits(rings.data_bits, rings.protect, written=ring == 0)
        made["sums"] += place
    codes = [code | parity(code) << row for code in rings.codes] if rings.protect != "none" else rings.codes
    made += of_rom(device, codes, row + check_bits(row, rings.protect))
    made += of_check_bits(row, rings.protect, written=False)
    operands = Multiplication(Operand(rings.pair_bits, signed=True), Operand(factor, signed=True))
    made += of_product(Product(operands), device)
    made["sums"] += rings.sum_bits + rings.pair_bits * rings.pairs
    made["registers"] += (
        2 * rings.pair_bits
        + factor
        + rings.sum_bits
        + rings.output_bits
        + rings.flags
        + 2 * rings.data_bits * (channels > 0)
    )
    return made
