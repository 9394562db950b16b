r"""Reads the program of a folded or serial core from its SystemVerilog.

::

    reg [n-1:0] \program [count-1:0];  instruction    n-1          a+4   a+3        4   3      0
    reg [..] words0 [depth-1:0];       word, cut into +-----------------+--------------+--------+
    reg [..] words8 [depth-1:0];       slices         |    constant     |   address    | opcode |
    reg [..] total;                    accumulator    +-----------------+--------------+--------+
    reg [..] given0, given1, ..        result          signed, as wide    a bits        see OPCODES
                                                       as a word

A word has ``digit_bits + 1`` bits, the sum of the slices' widths; a is what is left of an instruction. A channel has
``2**a`` words. What a TAKE stores is found by evaluating the logic before the words' write port for its instruction,
with the bits of `s_axis_tdata` as unknowns.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import takewhile
from typing import NamedTuple

from sosmith.gen.verifier.graph import require
from sosmith.gen.verifier.program.logic import Bit, Logic

OPCODES = ("nothing", "take", "multiply", "operand", "product", "store", "drop", "finish", "give", "judge")
"""Opcodes by their codes."""

_OPCODE_BITS = 4
NUMBER_BITS = 8
"""Bits of the constant that hold a digit's number."""


class Instruction(NamedTuple):
    """A decoded instruction."""

    opcode: str
    address: int
    constant: int

    def __str__(self) -> str:
        return f"{self.opcode}, address {self.address}, constant {self.constant}"


@dataclass(frozen=True)
class ProgramText:
    """The program of a core, and what its hardware makes of it.

    Attributes
    ----------
    codes : tuple of int
        The instructions, in the order of their addresses.
    code_bits : int
        Bits of an instruction.
    digit_bits : int
        Bits of a digit, one less than those of a word.
    words, channels : int
        Words of a channel, and number of channels.
    accumulator_bits : int
        Width of the accumulator.
    results : int
        Number of digits of the result.
    digits : tuple of list of Bit
        What TAKE stores for each digit number: the bits of the word, the lowest first. Higher numbers are as the last.
    """

    codes: tuple[int, ...]
    code_bits: int
    digit_bits: int
    words: int
    channels: int
    accumulator_bits: int
    results: int
    digits: tuple[list[Bit], ...]

    @cached_property
    def instructions(self) -> tuple[Instruction, ...]:
        """The decoded instructions."""
        return tuple(map(self.decoded, self.codes))

    def decoded(self, code: int) -> Instruction:
        """Decode an instruction; an opcode that does not exist does nothing."""
        opcode = code % (1 << _OPCODE_BITS)
        address = code >> _OPCODE_BITS & (self.words - 1)
        value = code >> (self.code_bits - self.digit_bits - 1)
        return Instruction(
            OPCODES[opcode] if opcode < len(OPCODES) else OPCODES[0],
            address,
            value - (value >> self.digit_bits << (self.digit_bits + 1)),
        )

    def named(self, number: int) -> str:
        """Name of an instruction, for messages."""
        return f"instruction {number} ({self.instructions[number]})"


def read_program(text: str) -> ProgramText:
    """Read the program from a core's SystemVerilog.

    Raises
    ------
    RejectedError
        If the text has no program, one that can be loaded at run time, or one that cannot be decoded.
    """
    require("s_axil_" not in text, "the program must be fixed to be checked, not loadable at run time")
    memories = _memories(text)
    require("program" in memories, "the core must be folded or serial to have a program, not parallel")
    codes, code_bits = memories["program"]
    slices = sorted((int(name[5:]), *memory) for name, memory in memories.items() if re.fullmatch(r"words\d+", name))
    widths = {name: int(top or 0) + 1 for top, name in _REGISTER.findall(text)}
    widths = {name.lstrip("\\"): width for name, width in widths.items()}
    require(bool(slices) and "total" in widths, "the core must have words and an accumulator beside its program")
    word_bits = sum(width for _, _, width in slices)
    address_bits = code_bits - _OPCODE_BITS - word_bits
    depth, words = len(slices[0][1]), 1 << max(address_bits, 0)
    require(
        address_bits > 0 and depth % words == 0 and all(len(held) == depth for _, held, _ in slices),
        f"an instruction must have an opcode, an address and a constant as wide as a word, not {code_bits} bits "
        f"for {depth} words of {word_bits} bits",
    )
    for address in range(depth):
        held = sum(content[address] << low for low, content, _ in slices)
        first = int(address % words == words - 1)
        require(held == first, f"word {address} must hold {first} before the first sample, not {held}")
    for number, code in enumerate(codes):
        opcode = code % (1 << _OPCODE_BITS)
        require(opcode < len(OPCODES), f"instruction {number} must have an opcode below {len(OPCODES)}, not {opcode}")
    return ProgramText(
        codes=tuple(codes),
        code_bits=code_bits,
        digit_bits=word_bits - 1,
        words=words,
        channels=depth // words,
        accumulator_bits=widths["total"],
        results=sum(re.fullmatch(r"given\d+", name) is not None for name in widths),
        digits=_digits(text, widths, slices, _OPCODE_BITS + address_bits),
    )


_MEMORY = re.compile(r"^ *reg (?:\[(\d+):0\] )?(\S+) *\[(\d+):0\];$", re.MULTILINE)
_HELD = re.compile(r"^ *(\S+?) *\[(\d+)\] = (\d+'\w+);$", re.MULTILINE)
_REGISTER = re.compile(r"^ *(?:output )?reg (?:\[(\d+):0\] )?(\S+) *(?:=.*)?;$", re.MULTILINE)


def _memories(text: str) -> dict[str, tuple[list[int], int]]:
    """Return the contents and the width of each memory."""
    contents: dict[str, dict[int, int]] = {}
    for name, address, value in _HELD.findall(text):
        held = contents.setdefault(name.lstrip("\\"), {})
        require(int(address) not in held, f"word {address} of {name} must be given once, not twice")
        held[int(address)] = _number(value)
    found = {}
    for top, name, last in _MEMORY.findall(text):
        plain, depth, width = name.lstrip("\\"), int(last) + 1, int(top or 0) + 1
        held = contents.get(plain, {})
        require(plain not in found, f"the memory {plain} must be declared once, not twice")
        require(sorted(held) == list(range(depth)), f"all {depth} words of {plain} must be given, not {len(held)}")
        require(max(held.values()) < 1 << width, f"the words of {plain} must have {width} bits, not more")
        found[plain] = [held[address] for address in range(depth)], width
    return found


def _number(token: str) -> int:
    """Value of a sized constant."""
    found = re.fullmatch(r"\d+'(?:h([0-9a-f]+)|d(\d+)|b([01]+))", token)
    require(found is not None, f"the word of a memory must be a number, not {token}")
    assert found is not None
    return int(found[1], 16) if found[1] else int(found[2] or found[3], 10 if found[2] else 2)


def _digits(
    text: str, registers: Mapping[str, int], slices: Sequence[tuple[int, list[int], int]], shift: int
) -> tuple[list[Bit], ...]:
    """Return what a TAKE of each number stores.

    A register of one bit is 0: while words are cleared, one of them is 1.
    """
    logic = Logic(text)
    writes = [re.findall(rf"^ *words{low}\[.*?\] <= (.*);$", text, re.MULTILINE) for low, _, _ in slices]
    require(all(len(write) == 1 for write in writes), "the words must have one write port")

    def stored(number: int) -> list[Bit]:
        code = OPCODES.index("take") | number << shift
        bound = {name: [0] for name, width in registers.items() if width == 1} | {
            name: [code >> i & 1 for i in range(width)]
            for name, width in registers.items()
            if re.fullmatch(r"instruction\d+", name)
        }
        return [bit for (write,) in writes for bit in logic.value(write, bound)]

    last = stored((1 << NUMBER_BITS) - 1)
    return (*takewhile(lambda digit: digit != last, map(stored, range(1 << NUMBER_BITS))), last)
