"""A program for one multiply-accumulate unit: its instructions, its words, and what it computes.

Numbers are split into digits of ``digit_bits`` bits: the lower ones lie in [0, 2**digit_bits), the top one has a
sign, so that every product of two digits fits one small signed multiplier. `sosmith.model.dataflow.folding` makes
programs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple

HAZARD = 4
"""An instruction that reads what another stored must come at least so many places after it."""


class Do(Enum):
    """What an instruction does: ``m`` is the word at its address, ``acc`` the accumulator, ``t`` the operand."""

    NOTHING = "nothing"
    TAKE = "take"  # m = digit of the input sample that the constant counts
    MULTIPLY = "multiply"  # acc += m * constant
    OPERAND = "operand"  # t = m
    PRODUCT = "product"  # acc += m * t
    STORE = "store"  # m = low digit of acc; acc >>= digit_bits
    DROP = "drop"  # acc >>= digit_bits
    FINISH = "finish"  # m = low digit_bits + 1 bits of acc, signed; acc = 0
    GIVE = "give"  # digit of the output sample that the constant counts = m
    JUDGE = "judge"  # the input is outside the calibrated range if acc < 0; acc = 0


class Instruction(NamedTuple):
    """One step of a program."""

    do: Do
    address: int = 0
    constant: int = 0


class Sample(NamedTuple):
    """What comes of a sample: the output's code before it is limited, and whether the input was outside its range."""

    code: int
    outside: bool


@dataclass(frozen=True)
class Place:
    """Where a value lives.

    Attributes
    ----------
    name : str
        Of the value.
    address : int
        Of its lowest digit, in the words of one channel.
    digits : int
        Number of digits.
    frac : int
        Fraction bits of the stored code.
    is_state : bool
        Whether it is kept from sample to sample.
    """

    name: str
    address: int
    digits: int
    frac: int
    is_state: bool


@dataclass(frozen=True, kw_only=True)
class Program:
    """A datapath, folded.

    Attributes
    ----------
    digit_bits : int
        Bits of a digit; a multiplier of ``digit_bits + 1`` bits, signed, serves.
    instructions : tuple of Instruction
        Executed once for each sample of each channel.
    places : tuple of Place
        All values that are stored.
    inputs : tuple of Place
        Those of the input ports, in port order, filled by TAKE.
    output : Place
        What GIVE hands out, before it is limited to the output's range.
    states : int
        Words that are kept from sample to sample, for each channel: the addresses from 0 on.
    words : int
        Words of memory for each channel, a power of two. The last one always holds 1.
    schedule : tuple of (str, int, int)
        What is done one after the other: name, first instruction and number of instructions of each value.
    accumulator_bits : int
        Width that the accumulator needs, by the ranges of everything that enters it.
    """

    digit_bits: int
    instructions: tuple[Instruction, ...]
    places: tuple[Place, ...]
    inputs: tuple[Place, ...]
    output: Place
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
        """Clocks of all instructions where a multiplication takes one for each bit of its second factor, at most."""
        return sum(map(self._serial_cycles, self.instructions))

    def _serial_cycles(self, instruction: Instruction) -> int:
        if instruction.do is Do.PRODUCT:
            return self.digit_bits + 1
        if instruction.do is not Do.MULTIPLY:
            return 1
        value = instruction.constant
        return value.bit_length() if value > 0 else (-value - 1).bit_length() + 1

    def padded(self, count: int) -> Program:
        """Return the same in `count` instructions: those that are missing do nothing, before all others.

        Raises
        ------
        ValueError
            If it has more.
        """
        missing = count - len(self.instructions)
        if missing < 0:
            raise ValueError(f"a program must have at most {count} instructions, not {len(self.instructions)}")
        waiting = [("waiting", 0, missing)] if missing else []
        return replace(
            self,
            instructions=(*[Instruction(Do.NOTHING)] * missing, *self.instructions),
            schedule=(*waiting, *((name, start + missing, count) for name, start, count in self.schedule)),
        )

    def reset(self) -> list[int]:
        """Words of a channel after reset."""
        return [int(address == self.one) for address in range(self.words)]

    def step(self, codes: Sequence[int], words: list[int], input_fracs: Sequence[int]) -> Sample:
        """Compute one sample in exact integers and advance `words` in place; the slow reference.

        Parameters
        ----------
        codes : sequence of int
            One code per input port.
        words : list of int
            The channel's memory, as from `reset`.
        input_fracs : sequence of int
            Fraction bits of the ports' codes.

        Returns
        -------
        Sample
            The output.

        Raises
        ------
        OverflowError
            If the accumulator leaves its width, or a word its digit.
        """
        base, limit = 1 << self.digit_bits, 1 << (self.accumulator_bits - 1)
        supply = [
            digit
            for code, frac, place in zip(codes, input_fracs, self.inputs, strict=True)
            for digit in digits_of(code << (place.frac - frac), place.digits, self.digit_bits)
        ]
        code = 0
        outside = False
        acc = operand = 0
        for do, address, constant in self.instructions:
            if do is Do.TAKE:
                words[address] = supply[constant]
            elif do is Do.MULTIPLY:
                acc += words[address] * constant
            elif do is Do.OPERAND:
                operand = words[address]
            elif do is Do.PRODUCT:
                acc += words[address] * operand
            elif do is Do.STORE:
                words[address], acc = acc % base, acc >> self.digit_bits
            elif do is Do.DROP:
                acc >>= self.digit_bits
            elif do is Do.FINISH:
                words[address], acc = (acc + base) % (2 * base) - base, 0
            elif do is Do.GIVE:
                code += words[address] << (self.digit_bits * constant)
            elif do is Do.JUDGE:
                outside, acc = outside or acc < 0, 0
            if not (-limit <= acc < limit and -base <= words[address] < base):
                raise OverflowError(f"the accumulator must stay within {self.accumulator_bits} bits, not {acc}")
        return Sample(code, outside)


def digits_of(code: int, count: int, digit_bits: int) -> list[int]:
    """Split `code` into `count` digits, the lowest first; only the top one has a sign."""
    low = [(code >> (digit_bits * k)) & ((1 << digit_bits) - 1) for k in range(count - 1)]
    return [*low, code >> (digit_bits * (count - 1))]
