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

from amaranth.hdl import Cat, Module, Signal, Value, signed
from amaranth.lib import data

from sosmith.hdl.plan.instructions import field_bits
from sosmith.model.dataflow.program import (
    CARRIES,
    CLEARS,
    EARLY_WRITES,
    FINISHES,
    LATE_WRITES,
    PRODUCTS,
    Judged,
    Opcode,
    Program,
)

_NUMBER_BITS = 8
"""Bits of the constant that may hold a digit's number: no value has more than 256 digits."""


def instruction_layout(program: Program) -> data.StructLayout:
    """Layout of an instruction of `program`; that of an opcode follows from its class."""
    bits = field_bits(program)
    constants = {name: signed(width) for name, width in bits.items() if name.endswith("constant")}
    return data.StructLayout({**bits, "opcode": Opcode, **constants})


_KINDS = {
    CARRIES: "carries",
    CLEARS: "clears",
    EARLY_WRITES: "moves",
    FINISHES: "finishes",
    LATE_WRITES: "stores",
    PRODUCTS: "multiplies_words",
}
"""What opcodes of a kind do."""


class PipelinedInstruction:
    """An instruction at one stage of the pipeline, whose fields are nets with names.

    The fields are made as they are asked for; as a signal that has the layout for its shape, an instruction would put
    a wire for each of them into the generated files.

    Parameters
    ----------
    m : Module
        Where it is decoded.
    name : str
        Name of its stage.
    code : Value
        The encoded instruction.
    valid : Value
        Whether there is one.
    program : Program
        The program it is from.
    """

    def __init__(self, m: Module, name: str, code: Value, valid: Value, program: Program) -> None:
        self.code = code
        self.valid = valid
        self.fields = data.View(instruction_layout(program), code)
        self._m = m
        self._name = name
        self._nets: dict[str, Signal] = {}

    def _net(self, name: str, value: Value) -> Signal:
        """Return the net of this name, which is the same whenever it is asked for."""
        if name not in self._nets:
            self._nets[name] = net = Signal(value.shape(), name=f"{self._name}_{name}")
            self._m.d.comb += net.eq(value)
        return self._nets[name]

    @property
    def address(self) -> Value:
        """The address of its word."""
        return self._net("address", self.fields.address)

    @property
    def target(self) -> Value:
        """The address that it writes."""
        return self._net("target", self.fields.target)

    @property
    def constant(self) -> Value:
        """Its constant."""
        return self._net("constant", self.fields.constant)

    @property
    def second_address(self) -> Value:
        """The address of its second word."""
        return self._net("second_address", self.fields.second_address)

    @property
    def second_constant(self) -> Value:
        """Its second constant."""
        return self._net("second_constant", self.fields.second_constant)

    def has(self, *opcodes: Opcode) -> Value:
        """Whether its opcode is one of `opcodes`, which are one alone or all of a kind."""
        matches = [self._net(f"is_{opcode.name.lower()}", self.fields.opcode == opcode) for opcode in sorted(opcodes)]
        return matches[0] if len(matches) == 1 else self._net(_KINDS[frozenset(opcodes)], Cat(matches).any())

    def is_for(self, digit: int) -> Value:
        """Whether its constant is the number `digit`, as that of TAKE."""
        return self._net(f"is_for_{digit}", _is(self.fields.constant[:_NUMBER_BITS], digit))

    def gives(self, part: int) -> Value:
        """Whether its target is the number `part`, as that of GIVE."""
        return self._net(f"gives_{part}", _is(self.fields.target, part))

    def judges(self, flag: Judged) -> Value:
        """Whether its target is a flag, as that of JUDGE, which has no other targets."""
        target = self.fields.target
        return self._net(f"judges_{flag.name.lower()}", target[0] if flag else ~target[0])


def _is(number: Value, wanted: int) -> Value:
    return number == wanted if wanted else ~number.any()  # Verilator warns of a comparison with 0
