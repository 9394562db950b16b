r"""Reads the program of a folded or serial core from its SystemVerilog.

::

    reg [n-1:0] instructions [count-1:0]; instruction    n-1       2a+4   2a+3   a+4   a+3     4   3      0
    reg [..] words0 [depth-1:0];       word, cut into +--------------+------------+-----------+--------+
    reg [..] words8 [depth-1:0];       slices         |   constant   |   target   |  address  | opcode |
    reg [..] total_low, total_high;    accumulator    +--------------+------------+-----------+--------+
    reg [..] given0, given1, ..        result          signed, as wide  a bits       a bits    see OPCODES
                                                       as a word

A word has ``digit_bits + 1`` bits, the sum of the slices' widths; 2a is what is left of an instruction. With two
products a clock, an address of a bits and a constant stand between target and constant, those of the second word. A
channel has
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

from sosmith.verify.graph import require
from sosmith.verify.program.logic import Bit, Logic
from sosmith.verify.reader.inlined import inlined
from sosmith.verify.reader.source import read_source
from sosmith.verify.reader.syntax import Module

OPCODES = (
    "multiply",
    "store",
    "drop",
    "finish",
    "give",
    "judge",
    "move",
    "operand",
    "product",
    "product_store",
    "product_drop",
    "product_finish",
    "take",
)
"""Opcodes by their codes."""

_OPCODE_BITS = 4
NUMBER_BITS = 8
"""Bits of the constant that hold a digit's number."""


class Instruction(NamedTuple):
    """A decoded instruction."""

    opcode: str
    address: int
    constant: int
    target: int
    second_address: int = 0
    second_constant: int = 0

    @property
    def end(self) -> str:
        """What it does after its multiplication, as an opcode."""
        return self.opcode.removeprefix("product_")

    @property
    def read(self) -> tuple[int, ...]:
        """The addresses of its words that count: not of those that are multiplied by 0."""
        if self.opcode == "take":
            return ()
        first = self.constant != 0 or self.multiplies_words or self.opcode in {"move", "operand"}
        return (self.address,) * first + (self.second_address,) * (self.second_constant != 0)

    @property
    def writes(self) -> bool:
        """Whether it writes a word."""
        return self.end in {"store", "finish", "move", "take"}

    @property
    def is_early(self) -> bool:
        """Whether it writes at the clock of the instruction before."""
        return self.opcode in {"move", "take"}

    @property
    def multiplies_words(self) -> bool:
        """Whether it multiplies by the operand register."""
        return self.opcode.startswith("product")

    def __str__(self) -> str:
        second = f", second address {self.second_address}, second constant {self.second_constant}"
        first = f"{self.opcode}, address {self.address}, constant {self.constant}, target {self.target}"
        return first + (second if self.second_constant else "")


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
    results : tuple of int
        Width of each part of the result, the lowest first.
    digits : tuple of list of Bit
        What TAKE stores for each digit number: the bits of the word, the lowest first. Higher numbers are as the last.
    products : int
        Products at each clock, 1 or 2.
    """

    codes: tuple[int, ...]
    code_bits: int
    digit_bits: int
    words: int
    channels: int
    accumulator_bits: int
    results: tuple[int, ...]
    digits: tuple[list[Bit], ...]
    products: int = 1

    @cached_property
    def instructions(self) -> tuple[Instruction, ...]:
        """The decoded instructions."""
        return tuple(map(self.decoded, self.codes))

    def decoded(self, code: int) -> Instruction:
        """Decode an instruction; an opcode that does not exist multiplies."""
        opcode = code % (1 << _OPCODE_BITS)
        bits = self.words.bit_length() - 1
        address, target, second = (
            code >> start & (self.words - 1) for start in range(_OPCODE_BITS, _OPCODE_BITS + 3 * bits, bits)
        )
        name = OPCODES[opcode] if opcode < len(OPCODES) else OPCODES[0]
        value = self._constant(code >> (self.code_bits - self.digit_bits - 1))
        if self.products == 1:
            return Instruction(name, address, value, target)
        return Instruction(name, address, value, target, second, self._constant(code >> (_OPCODE_BITS + 3 * bits)))

    def _constant(self, code: int) -> int:
        """Return the lowest bits of an instruction's rest as a signed constant."""
        value = code & ((2 << self.digit_bits) - 1)
        return value - (value >> self.digit_bits << (self.digit_bits + 1))

    def part(self, target: int) -> int | None:
        """Return the part of the result that GIVE writes; None if there is no such part."""
        if len(self.results) == 1:
            return 0
        return target if target < len(self.results) else None

    def named(self, number: int) -> str:
        """Name of an instruction, for messages."""
        return f"instruction {number} ({self.instructions[number]})"


def read_program(text: str, top: str | None = None) -> ProgramText:
    """Read the program from a core's SystemVerilog, whose module is `top`.

    Raises
    ------
    RejectedError
        If the text has no program, one that can be loaded at run time, or one that cannot be decoded.
    """
    source = read_source(text, top)
    source = inlined(source, next(iter(source.modules)))
    require("s_axil_" not in source.text, "the program must be fixed to be checked, not loadable at run time")
    require(len(source.modules) == 1, f"a program must be in the only module, not in one of {len(source.modules)}")
    (module,) = source.modules.values()
    require("instructions" in module.depths, "the core must be folded or serial to have a program, not parallel")
    codes, code_bits = _held(module, "instructions"), module.widths["instructions"]
    slices = sorted(
        (int(name[5:]), _held(module, name), module.widths[name])
        for name in module.depths
        if re.fullmatch(r"words\d+", name)
    )
    widths = {name: module.widths[name] for name in module.registers}
    accumulator = [widths[name] for name in ("total_low", "total_high") if name in widths]
    require(bool(slices) and len(accumulator) == 2, "the core must have words and an accumulator beside its program")
    word_bits = sum(width for _, _, width in slices)
    products = 2 if _SECOND in widths else 1
    address_bits, odd = divmod(code_bits - _OPCODE_BITS - products * word_bits, 1 + products)
    depth, words = len(slices[0][1]), 1 << max(address_bits, 0)
    kinds = "two addresses and a constant" if products == 1 else "three addresses and two constants"
    require(
        address_bits > 0
        and not odd
        and depth % words == 0
        and all(len(first_word) == depth for _, first_word, _ in slices),
        f"an instruction must have an opcode, {kinds} as wide as a word, not {code_bits} bits "
        f"for {depth} words of {word_bits} bits",
    )
    for address in range(depth):
        first_word = sum(content[address] << low for low, content, _ in slices)
        first = int(address % words == words - 1)
        require(first_word == first, f"word {address} must hold {first} before the first sample, not {first_word}")
    for number, code in enumerate(codes):
        opcode = code % (1 << _OPCODE_BITS)
        require(opcode < len(OPCODES), f"instruction {number} must have an opcode below {len(OPCODES)}, not {opcode}")
    return ProgramText(
        codes=tuple(codes),
        code_bits=code_bits,
        digit_bits=word_bits - 1,
        words=words,
        channels=depth // words,
        accumulator_bits=sum(accumulator),
        results=_results(widths),
        digits=_digits(source.text, widths, word_bits, code_bits - word_bits),
        products=products,
    )


def _results(widths: Mapping[str, int]) -> tuple[int, ...]:
    """Return the widths of the registers that hold a result: one that leaves as it is has the name of its port."""
    parts = tuple(widths[name] for name in sorted(widths, key=_number_of) if re.fullmatch(r"given\d+", name))
    return parts or tuple(width for name, width in widths.items() if name == _OUTPUT)


_OUTPUT = "m_axis_tdata"
_SECOND = "second_data"
"""The register that a second word is multiplied from."""

_PASSES = re.compile(r"moved|passed\d+")
"""Registers that a word passes on its way to the memory."""


def _held(module: Module, name: str) -> list[int]:
    """Return what the words of a memory hold before the first clock."""
    return [module.contents[name][address] for address in range(module.depths[name])]


def _number_of(name: str) -> tuple[int, str]:
    """Sort the registers of a family, whose names end in their numbers."""
    return int(re.sub(r"\D", "", name) or 0), name


def _digits(text: str, registers: Mapping[str, int], word_bits: int, shift: int) -> tuple[list[Bit], ...]:
    """Return what a TAKE of each number stores, directly or through `moved` and the registers before that.

    A register of one bit is 0, unless it says that there is an instruction: while words are cleared, one of them is 1.
    """
    logic = Logic(text)
    slices = [int(low) for low in re.findall(r"^ *words(\d+)\[.*?\] <= ", text, re.MULTILINE)]
    require(len(set(slices)) == len(slices), "the words must have one write port")
    writes = [_written(text, rf"words{low}\[.*?\]") for low in sorted(slices)]
    passed = {name: _passed(text, word_bits, name) for name in registers if _PASSES.fullmatch(name)}

    def stored(number: int) -> list[Bit]:
        code = OPCODES.index("take") | number << shift
        bound = {
            name: [int(re.fullmatch(r"valid\d+", name) is not None)] for name, width in registers.items() if width == 1
        }
        bound["aresetn"] = [1]
        bound |= {
            name: [code >> i & 1 for i in range(width)]
            for name, width in registers.items()
            if re.fullmatch(r"instruction\d+", name)
        }
        bits = [bit for write in writes for bit in write.bits(logic, bound)]
        for _ in passed:
            through = next((name for name in passed if bits == [(name, i) for i in range(word_bits)]), None)
            if through is not None:
                bits = [bit for write in passed[through] for bit in write.bits(logic, bound)]
        return bits

    last = stored((1 << NUMBER_BITS) - 1)
    return (*takewhile(lambda digit: digit != last, map(stored, range(1 << NUMBER_BITS))), last)


class _Write(NamedTuple):
    """What is written to a register or a memory: `value`, or with an `else`, `otherwise` unless `condition` holds."""

    condition: str
    value: str
    otherwise: str

    def bits(self, logic: Logic, bound: Mapping[str, Sequence[Bit]]) -> list[Bit]:
        """Return the bits of it, with the given bits for some of the signals."""
        is_other = self.otherwise and logic.value(self.condition, bound) == [0]
        return logic.value(self.otherwise if is_other else self.value, bound)


def _passed(text: str, word_bits: int, name: str) -> list[_Write]:
    """Return what is written to a register, the lowest bits first: at once, or in slices where some may be cleared."""
    slices = re.findall(rf"^ *(?:if \(.*\) )?{name}\[(\d+)(?::(\d+))?\] <= ", text, re.MULTILINE)
    if not slices:
        return [_written(text, name)]
    ends = sorted((int(low or high), int(high)) for high, low in slices)
    starts = [0, *(high + 1 for _, high in ends)]
    whole = starts == [*(low for low, _ in ends), word_bits]
    require(whole, f"each of the {word_bits} bits of {name} must be written at one place")
    return [_written(text, rf"{name}\[{high}(?::{low})?\]") for low, high in ends]


def _written(text: str, register: str) -> _Write:
    """Return what is written to a register or a memory; the condition of a write without an `else` does not count."""
    write = rf"^ *(?:if \((.*)\) )?{register} <= (.*);(?:\n *else {register} <= (.*);)?$"
    writes = re.findall(write, text, re.MULTILINE)
    require(len(writes) == 1, f"there must be one place where {register} is written, not {len(writes)}")
    return _Write(*writes[0])
