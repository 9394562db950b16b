"""The program of one multiply-accumulate unit: its instructions, its memory, and what a sample makes of them.

A number is stored as digits of ``digit_bits`` bits, one to a memory word of ``digit_bits + 1`` bits. The lower digits
lie in [0, 2**digit_bits); the top one is signed. A product of any two digits then fits one small signed multiplier:
with ``digit_bits = 2``, -7 is the digits 1, -2 (lowest first), since -7 = 1 + (-2) * 4.

::

    words of one channel         registers               instruction
      0 .. states-1    states      acc   accumulator       opcode | address | constant
      states ..        values      t     operand
      words-1          always 1

`sosmith.model.dataflow.folding` makes programs; `sosmith.hdl.folded` runs them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import NamedTuple

HAZARD = 4
"""Least number of instructions from one that stores a word to one that reads it.

The folded core writes words three pipeline stages after it reads them (`sosmith.hdl.folded`).
"""


class Opcode(IntEnum):
    """Operation of an instruction, and its code in hardware.

    ``m`` is the memory word at the instruction's address, ``acc`` the accumulator, ``t`` the operand register.
    """

    NOTHING = 0
    TAKE = 1  # m = digit number `constant` of the input sample
    MULTIPLY = 2  # acc += m * constant
    OPERAND = 3  # t = m
    PRODUCT = 4  # acc += m * t
    STORE = 5  # m = low digit of acc; acc >>= digit_bits
    DROP = 6  # acc >>= digit_bits
    FINISH = 7  # m = low digit_bits + 1 bits of acc, signed; acc = 0
    GIVE = 8  # digit number `constant` of the output sample = m
    JUDGE = 9  # if acc < 0, the input is outside the calibrated range; acc = 0

    @property
    def mnemonic(self) -> str:
        """Name in the manifest."""
        return self.name.lower()


class Instruction(NamedTuple):
    """One step of a program."""

    opcode: Opcode
    address: int = 0
    constant: int = 0


class Sample(NamedTuple):
    """Result of a sample: the output code before it is limited, and whether the input left the calibrated range."""

    code: int
    outside: bool


@dataclass(frozen=True)
class Location:
    """Where a value is stored.

    Attributes
    ----------
    name : str
        Name of the value.
    address : int
        Address of its lowest digit within the words of one channel.
    digits : int
        Number of digits.
    frac : int
        Fraction bits of the stored code.
    is_state : bool
        Whether it is kept from one sample to the next.
    """

    name: str
    address: int
    digits: int
    frac: int
    is_state: bool


@dataclass(frozen=True, kw_only=True)
class Program:
    """A datapath folded into instructions for one multiply-accumulate unit.

    Attributes
    ----------
    digit_bits : int
        Bits of a digit; the multiplier is signed and has ``digit_bits + 1`` bits.
    instructions : tuple of Instruction
        Run once for each sample of each channel.
    locations : tuple of Location
        All stored values.
    inputs : tuple of Location
        Those of the input ports, in port order; TAKE fills them.
    output : Location
        The result before it is limited to the output's range; GIVE reads it.
    states : int
        Words of each channel that are kept from one sample to the next: the addresses from 0 on.
    words : int
        Words of memory for each channel, a power of two; the last one always holds 1.
    schedule : tuple of (str, int, int)
        Values in the order in which they are computed: name, first instruction, number of instructions.
    accumulator_bits : int
        Width of the accumulator, from the ranges of everything that is added to it.
    """

    digit_bits: int
    instructions: tuple[Instruction, ...]
    locations: tuple[Location, ...]
    inputs: tuple[Location, ...]
    output: Location
    states: int
    words: int
    schedule: tuple[tuple[str, int, int], ...]
    accumulator_bits: int

    @property
    def one(self) -> int:
        """Address of the word that always holds 1."""
        return self.words - 1

    @property
    def serial_cycles(self) -> int:
        """Clocks of all instructions, at most, if a multiplication takes one for each bit of its second factor."""
        return sum(map(self._serial_cycles, self.instructions))

    def _serial_cycles(self, instruction: Instruction) -> int:
        if instruction.opcode is Opcode.PRODUCT:
            return self.digit_bits + 1
        if instruction.opcode is not Opcode.MULTIPLY:
            return 1
        value = instruction.constant
        return value.bit_length() if value > 0 else (-value - 1).bit_length() + 1

    def padded(self, count: int) -> Program:
        """Return the program with NOTHING put before it, so that it has `count` instructions.

        Raises
        ------
        ValueError
            If it has more than `count`.
        """
        missing = count - len(self.instructions)
        if missing < 0:
            raise ValueError(f"a program must have at most {count} instructions, not {len(self.instructions)}")
        waiting = [("waiting", 0, missing)] if missing else []
        return replace(
            self,
            instructions=(*[Instruction(Opcode.NOTHING)] * missing, *self.instructions),
            schedule=(*waiting, *((name, start + missing, count) for name, start, count in self.schedule)),
        )

    def reset(self) -> list[int]:
        """Return the words of a channel after reset."""
        return [int(address == self.one) for address in range(self.words)]

    def step(self, codes: Sequence[int], words: list[int], input_fracs: Sequence[int]) -> Sample:
        """Run the program for one sample in exact integers and update `words` in place; the slow reference.

        Parameters
        ----------
        codes : sequence of int
            One code for each input port.
        words : list of int
            The channel's memory, as `reset` returns it.
        input_fracs : sequence of int
            Fraction bits of these codes.

        Returns
        -------
        Sample
            The result.

        Raises
        ------
        OverflowError
            If the accumulator overflows, or a word does not hold a digit.
        """
        base, limit = 1 << self.digit_bits, 1 << (self.accumulator_bits - 1)
        supply = [
            digit
            for code, frac, location in zip(codes, input_fracs, self.inputs, strict=True)
            for digit in digits_of(code << (location.frac - frac), location.digits, self.digit_bits)
        ]
        code = 0
        outside = False
        acc = operand = 0
        for opcode, address, constant in self.instructions:
            if opcode is Opcode.TAKE:
                words[address] = supply[constant]
            elif opcode is Opcode.MULTIPLY:
                acc += words[address] * constant
            elif opcode is Opcode.OPERAND:
                operand = words[address]
            elif opcode is Opcode.PRODUCT:
                acc += words[address] * operand
            elif opcode is Opcode.STORE:
                words[address], acc = acc % base, acc >> self.digit_bits
            elif opcode is Opcode.DROP:
                acc >>= self.digit_bits
            elif opcode is Opcode.FINISH:
                words[address], acc = (acc + base) % (2 * base) - base, 0
            elif opcode is Opcode.GIVE:
                code += words[address] << (self.digit_bits * constant)
            elif opcode is Opcode.JUDGE:
                outside, acc = outside or acc < 0, 0
            if not (-limit <= acc < limit and -base <= words[address] < base):
                raise OverflowError(f"the accumulator must stay within {self.accumulator_bits} bits, not {acc}")
        return Sample(code, outside)


def digits_of(code: int, count: int, digit_bits: int) -> list[int]:
    """Split `code` into `count` digits, the lowest first; only the top one has a sign."""
    low = [(code >> (digit_bits * k)) & ((1 << digit_bits) - 1) for k in range(count - 1)]
    return [*low, code >> (digit_bits * (count - 1))]
