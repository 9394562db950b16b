"""Quantities of hardware in which one unit runs a program."""

from __future__ import annotations

from collections import Counter

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.estimate.graphs import clamp
from sosmith.gen.estimate.memories import of_memory, of_rom
from sosmith.gen.estimate.products import Product, of_product
from sosmith.gen.estimate.quantities import (
    Quantities,
    check_bits,
    of_check_bits,
    of_inputs,
    parity,
)
from sosmith.gen.fpga.boards import Device
from sosmith.gen.word_lengths.cost import Multiplication, Operand
from sosmith.hdl.plan.folded_clocks import memory_depth, pipeline_depth, word_slices
from sosmith.hdl.plan.instructions import address_bits, encoded, instruction_bits
from sosmith.hdl.plan.streams import channel_bits
from sosmith.model.dataflow.graph import Op
from sosmith.model.dataflow.program import Opcode, Program


def of_program(architecture: Architecture, device: Device) -> Quantities:
    """Count a core that runs a program, without what stands before its decimator."""
    program, channels = architecture.program, architecture.channels
    assert program is not None
    serial, word, acc = not architecture.multiplier_blocks, program.digit_bits + 1, program.accumulator_bits
    made = _memories(architecture, program, device)
    made += _result(architecture, program)
    made["words"] += word
    made["accumulators"] += acc
    made["counters"] += _counter_bits(program, channels)
    made["digits"] += (sum(location.digits for location in program.inputs) - 1) * word
    made["operands"] += word * (architecture.reload or any(i.opcode is Opcode.OPERAND for i in program.instructions))
    made["shifts"] += 2 * word * serial
    if not serial:
        factor = Operand(word, signed=True)
        for _ in range(program.products):
            made += of_product(Product(Multiplication(factor, factor)), device)
    if program.products > 1:  # their sum, and a word that waits for it
        made["accumulators"] += 2 * word + 1
        made["registers"] += 2 * word + 1 + 2 * word
    made["channels"] += channel_bits(channels)
    depth = pipeline_depth(program, serial=serial)
    made["registers"] += acc + word * (4 if serial else 3) + (depth - 1) * (instruction_bits(program) + 1)
    made["opcodes"] += len({i.opcode for i in program.instructions})
    return made


def _counter_bits(program: Program, channels: int) -> int:
    count = len(program.instructions)
    return max((count - 1).bit_length(), address_bits(program) + max(1, channel_bits(channels)))


def _memories(architecture: Architecture, program: Program, device: Device) -> Quantities:
    """Count program memory and words, with their check bits."""
    made: Quantities = Counter()
    word, depth = program.digit_bits + 1, memory_depth(program, architecture.channels)
    bits, count = instruction_bits(program), len(program.instructions)
    codes = [encoded(instruction, program) for instruction in program.instructions]
    protect = architecture.protect
    is_written = architecture.reload or protect == "correct"
    made += of_check_bits(word, protect) + of_check_bits(bits, protect, written=is_written)
    made["guards"] += protect != "none"
    if architecture.reload:
        count = 2 << (count - 1).bit_length()
        made["ports"] += architecture.has_registers
        made["guarded_ports"] += architecture.has_registers and protect != "none"
        made["loaded"] += bits
    words, program_bits = word + check_bits(word, protect), bits + check_bits(bits, protect)
    for low, high in word_slices(depth, words):
        for _ in range(program.products):  # a word that is read beside another one lies in a memory of its own
            made += of_memory(device, depth, high - low)
    if is_written:
        return made + of_memory(device, count, program_bits)
    guarded = [code | parity(code) << bits if protect != "none" else code for code in codes]
    return made + of_rom(device, guarded, program_bits, block=program.products > 1)


def _result(architecture: Architecture, program: Program) -> Quantities:
    """Count what collects a result, limits it, and finds its status."""
    datapath = architecture.datapath.behind_decimator
    graph, output = datapath.stages[-1].graph, datapath.output
    last = graph.nodes[graph.outputs[0]]
    made: Quantities = Counter()
    if last.op is Op.CLAMP:
        made += clamp(last, graph.nodes[last.operands[0]])
    if architecture.decimator is None:
        made += of_inputs(datapath.inputs, [])
    made["registers"] += output.bits + 6
    made["compared"] += 2 * output.bits * bool(datapath.wear)
    return made
