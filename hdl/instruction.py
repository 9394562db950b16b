"""An instruction in the program memory of the folded and serial architectures, and in their pipeline.

::

     n-1           a+4   a+3        4   3      0
    +-----------------+--------------+--------+
    |    constant     |   address    | opcode |     n = 4 + a + digit_bits + 1
    +-----------------+--------------+--------+
        signed,         a bits: a word     `sosmith.model.dataflow.program.Opcode`
      digit_bits + 1    of one channel

With digits of 15 bits and 64 words for each channel, an instruction has 26 bits. `Opcode` is an `IntEnum` of Python, as
`sosmith.model` does without Amaranth, which derives the width of the field from it.
"""

from __future__ import annotations

from amaranth.hdl import Value, signed
from amaranth.lib import data

from sosmith.model.dataflow.program import Instruction, Opcode, Program

_NUMBER_BITS = 8
"""Bits of the constant that may hold a digit's number: no value has more than 256 digits."""


def address_bits(program: Program) -> int:
    """Width of an address within the words of one channel."""
    return (program.words - 1).bit_length()


def instruction_layout(program: Program) -> data.StructLayout:
    """Layout of an instruction, as wide as the words and digits of `program` need."""
    return data.StructLayout(
        {"opcode": Opcode, "address": address_bits(program), "constant": signed(program.digit_bits + 1)}
    )


def instruction_bits(program: Program) -> int:
    """Width of an instruction."""
    return int(instruction_layout(program).size)


def encoded(instruction: Instruction, program: Program) -> int:
    """Return an instruction of `program` as its memory holds it."""
    return int(instruction_layout(program).const(instruction._asdict()).as_bits())


class PipelinedInstruction:
    """An instruction at one stage of the pipeline.

    The fields are a view of a plain signal: a signal that has the layout for its shape would put a wire for each
    field into the generated files.

    Parameters
    ----------
    code : Value
        The encoded instruction.
    valid : Value
        Whether there is one.
    program : Program
        The program it is from.
    """

    def __init__(self, code: Value, valid: Value, program: Program) -> None:
        self.code = code
        self.valid = valid
        fields = data.View(instruction_layout(program), code)
        self.address: Value = fields.address
        self.constant: Value = fields.constant
        self._opcode: Value = fields.opcode

    def has(self, opcode: Opcode) -> Value:
        """Whether its opcode is `opcode`."""
        return self._opcode == opcode

    def is_for(self, digit: int) -> Value:
        """Whether its constant is the number `digit`, as that of TAKE and GIVE."""
        number = self.constant[:_NUMBER_BITS]
        return number == digit if digit else ~number.any()  # Verilator warns of a comparison with 0
