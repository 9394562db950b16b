"""Widths of an instruction in the program memory of the folded and serial architectures, and its code there.

The picture is in `sosmith.hdl.instruction`.
"""

from __future__ import annotations

from sosmith.model.dataflow.program import Instruction, Opcode, Program


def address_bits(program: Program) -> int:
    """Width of an address within the words of one channel."""
    return (program.words - 1).bit_length()


def field_bits(program: Program) -> dict[str, int]:
    """Width of each field of an instruction, the lowest first, as the words and digits of `program` need it."""
    address, constant = address_bits(program), program.digit_bits + 1  # signed
    second = {"second_address": address, "second_constant": constant} if program.products > 1 else {}
    return {"opcode": max(Opcode).bit_length(), "address": address, "target": address, **second, "constant": constant}


def instruction_bits(program: Program) -> int:
    """Width of an instruction."""
    return sum(field_bits(program).values())


def encoded(instruction: Instruction, program: Program) -> int:
    """Return an instruction of `program` as its memory holds it."""
    code = offset = 0
    for name, bits in field_bits(program).items():
        code |= (getattr(instruction, name) & ((1 << bits) - 1)) << offset
        offset += bits
    return code
