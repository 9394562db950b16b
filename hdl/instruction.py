"""An instruction in the program memory of the folded and serial architectures, and in their pipeline.

::

     n-1         2a+4   2a+3   a+4  a+3     4  3      0
    +-----------------+------------+----------+--------+
    |    constant     |   target   | address  | opcode |     n = 4 + 2a + digit_bits + 1
    +-----------------+------------+----------+--------+
        signed,       a bits each: words of     `sosmith.model.dataflow.program.Opcode`
      digit_bits + 1  one channel

With digits of 15 bits and 64 words for each channel, an instruction has 32 bits. `Opcode` is an `IntEnum` of Python, as
`sosmith.model` does without Amaranth, which derives the width of the field from it.
"""

from __future__ import annotations

from amaranth.hdl import Cat, Value, signed
from amaranth.lib import data

from sosmith.hdl.plan.instructions import field_bits
from sosmith.model.dataflow.program import Judged, Opcode, Program

_NUMBER_BITS = 8
"""Bits of the constant that may hold a digit's number: no value has more than 256 digits."""


def instruction_layout(program: Program) -> data.StructLayout:
    """Layout of an instruction of `program`; that of an opcode follows from its class."""
    bits = field_bits(program)
    return data.StructLayout({**bits, "opcode": Opcode, "constant": signed(bits["constant"])})


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
        self.target: Value = fields.target
        self.constant: Value = fields.constant
        self._opcode: Value = fields.opcode

    def has(self, *opcodes: Opcode) -> Value:
        """Whether its opcode is one of `opcodes`."""
        return Cat(self._opcode == opcode for opcode in sorted(opcodes)).any()

    def is_for(self, digit: int) -> Value:
        """Whether its constant is the number `digit`, as that of TAKE."""
        return _is(self.constant[:_NUMBER_BITS], digit)

    def gives(self, part: int) -> Value:
        """Whether its target is the number `part`, as that of GIVE."""
        return _is(self.target, part)

    def judges(self, flag: Judged) -> Value:
        """Whether its target is a flag, as that of JUDGE, which has no other targets."""
        return self.target[0] if flag else ~self.target[0]


def _is(number: Value, wanted: int) -> Value:
    return number == wanted if wanted else ~number.any()  # Verilator warns of a comparison with 0
