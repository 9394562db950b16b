"""The program of one multiply-accumulate unit: its instructions, its memory, and what a sample makes of them.

A number is stored as digits of ``digit_bits`` bits, one to a memory word of ``digit_bits + 1`` bits. The lower digits
lie in [0, 2**digit_bits); the top one is signed. A product of any two digits then fits one small signed multiplier:
with ``digit_bits = 2``, -7 is the digits 1, -2 (lowest first), since -7 = 1 + (-2) * 4.

::

    words of one channel         registers               instruction
      0 .. states-1    states      acc   accumulator       opcode | address | target | constant
      states ..        values      t     operand
      words-1          always 1

An instruction of a program with two products a clock also has a second address and a second constant.

`sosmith.model.dataflow.folding.fold` makes programs; `sosmith.hdl.cores.folded` runs them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import NamedTuple


class Opcode(IntEnum):
    """Operation of an instruction, and its code in hardware.

    ``m`` is the memory word at the instruction's address, ``target`` the one that it writes, ``acc`` the accumulator,
    ``t`` the operand register. Every instruction but PRODUCT and its kind begins with ``acc += m * constant``. Where
    there are two products a clock, all begin with ``acc += (word at the second address) * (second constant)`` besides.
    """

    MULTIPLY = 0  # no more
    STORE = 1  # target = low digit of acc; acc >>= digit_bits
    DROP = 2  # acc >>= digit_bits
    FINISH = 3  # target = low digit_bits + 1 bits of acc, signed; acc = 0
    GIVE = 4  # part number `target` of the result = acc, of all but the last its low digit; acc >>= digit_bits
    JUDGE = 5  # if acc < 0, flag `target` is set, one of `Judged`; acc = 0
    MOVE = 6  # target = m
    OPERAND = 7  # t = m
    PRODUCT = 8  # acc += m * t
    PRODUCT_STORE = 9  # .. and what STORE does
    PRODUCT_DROP = 10
    PRODUCT_FINISH = 11
    TAKE = 12  # target = digit number `constant` of the input sample; acc = 0

    @property
    def mnemonic(self) -> str:
        """Name in the manifest."""
        return self.name.lower()


PRODUCTS = frozenset({Opcode.PRODUCT, Opcode.PRODUCT_STORE, Opcode.PRODUCT_DROP, Opcode.PRODUCT_FINISH})
"""Opcodes that multiply by the operand register."""

STORES = frozenset({Opcode.STORE, Opcode.PRODUCT_STORE})
"""Opcodes that store a digit, and go on with what is left."""

FINISHES = frozenset({Opcode.FINISH, Opcode.PRODUCT_FINISH})
"""Opcodes that store the top digit."""

CARRIES = frozenset({*STORES, Opcode.DROP, Opcode.PRODUCT_DROP, Opcode.GIVE})
"""Opcodes that end a column: they carry what is above its digit to the next one."""

CLEARS = frozenset({*FINISHES, Opcode.JUDGE, Opcode.TAKE})
"""Opcodes after which the accumulator is 0."""

EARLY_WRITES = frozenset({Opcode.MOVE, Opcode.TAKE})
"""Opcodes that write a word as it is: with one product a clock, at the clock at which the instruction before would.

They must not follow one of `LATE_WRITES` then. With two products, all write at the end of the pipeline.
"""

LATE_WRITES = frozenset({*STORES, *FINISHES})
"""Opcodes that write their word from the end of the pipeline."""

STORED = 4
"""Least number of instructions from one of `LATE_WRITES` to one that reads its word, with one product a clock.

With two there is one more, since their sum has a pipeline stage of its own.
"""

MOVED = 3
"""Least number of instructions from one of `EARLY_WRITES` to one that reads its word, with one product a clock."""


def distance_stored(products: int) -> int:
    """Least number of instructions from one of `LATE_WRITES` to one that reads its word."""
    return STORED + products - 1


def distance_moved(products: int) -> int:
    """Least number of instructions from one of `EARLY_WRITES` to one that reads its word."""
    return MOVED if products == 1 else distance_stored(products)


class Judged(IntEnum):
    """Flag that JUDGE sets, by its target."""

    OUTSIDE = 0  # the input is outside the calibrated range
    SETTLING = 1  # the filter started from zero and has not settled


class Instruction(NamedTuple):
    """One step of a program; the last two fields count where there are two products a clock."""

    opcode: Opcode
    address: int
    constant: int = 0
    target: int = 0
    second_address: int = 0
    second_constant: int = 0


class Sample(NamedTuple):
    """Result of a sample.

    Attributes
    ----------
    code : int
        The output code before it is limited.
    outside : bool
        Whether the input left the calibrated range.
    settling : bool
        Whether the sample comes before the filter has settled.
    """

    code: int
    outside: bool
    settling: bool = False


@dataclass(frozen=True)
class Location:
    """Where a value is stored.

    Attributes
    ----------
    name : str
        Name of the value.
    addresses : tuple of int
        Addresses of its digits within the words of one channel, the lowest digit first.
    frac : int
        Fraction bits of the stored code.
    is_state : bool
        Whether it is kept from one sample to the next.
    """

    name: str
    addresses: tuple[int, ...]
    frac: int
    is_state: bool

    @property
    def digits(self) -> int:
        """Number of digits."""
        return len(self.addresses)


class Result(NamedTuple):
    """The result before it is limited to the output's range: name, fraction bits, and number of parts (GIVE)."""

    name: str
    frac: int
    parts: int


@dataclass(frozen=True, kw_only=True)
class Program:
    """A datapath folded into instructions for one multiply-accumulate unit.

    Attributes
    ----------
    digit_bits : int
        Bits of a digit; the multiplier is signed and has ``digit_bits + 1`` bits.
    instructions : tuple of Instruction
        Run once for each sample of each channel; the last one is a GIVE.
    locations : tuple of Location
        All stored values. Those that are also kept in a state may share its words.
    inputs : tuple of Location
        Those of the input ports, in port order; TAKE fills them.
    output : Result
        The result; GIVE hands it out.
    states : int
        Words of each channel that are kept from one sample to the next: the addresses from 0 on.
    words : int
        Words of memory for each channel, a power of two; the last one always holds 1.
    schedule : tuple of (str, int, int)
        Values in the order in which they are computed: name, first instruction, number of instructions.
    accumulator_bits : int
        Width of the accumulator, from the ranges of everything that is added to it.
    products : int
        Products at each clock, 1 or 2: as many multipliers, and words that an instruction reads.
    """

    digit_bits: int
    instructions: tuple[Instruction, ...]
    locations: tuple[Location, ...]
    inputs: tuple[Location, ...]
    output: Result
    states: int
    words: int
    schedule: tuple[tuple[str, int, int], ...]
    accumulator_bits: int
    products: int = 1

    @property
    def one(self) -> int:
        """Address of the word that always holds 1."""
        return self.words - 1

    @property
    def nothing(self) -> Instruction:
        """An instruction that changes nothing."""
        return Instruction(Opcode.MULTIPLY, self.one, second_address=self.one if self.products > 1 else 0)

    @property
    def stored(self) -> int:
        """Least number of instructions from one of `LATE_WRITES` to one that reads its word."""
        return distance_stored(self.products)

    @property
    def moved(self) -> int:
        """Least number of instructions from one of `EARLY_WRITES` to one that reads its word."""
        return distance_moved(self.products)

    def addresses_read(self, instruction: Instruction) -> tuple[int, ...]:
        """Return the addresses of the words that an instruction reads."""
        return (instruction.address, instruction.second_address)[: self.products]

    @property
    def result_start(self) -> int:
        """Number of the first instruction of the result; the accumulator is empty before it."""
        _, start, _ = self.schedule[-1]
        return start

    @property
    def follows_itself(self) -> bool:
        """Whether the first instruction may follow the last one at once: no word would be read or written too early."""
        readable: dict[int, int] = {}
        last = self.instructions[-1].opcode
        for number, instruction in enumerate((*self.instructions, *self.instructions)):
            opcode = instruction.opcode
            early = any(readable.get(address, 0) > number for address in self.addresses_read(instruction))
            if early or (self.moved != self.stored and last in LATE_WRITES and opcode in EARLY_WRITES):
                return False
            if opcode in LATE_WRITES or opcode in EARLY_WRITES:
                readable[instruction.target] = number + (self.stored if opcode in LATE_WRITES else self.moved)
            last = opcode
        return True

    @property
    def serial_cycles(self) -> int:
        """Clocks of all instructions, at most, if a multiplication takes one for each bit of its second factor."""
        return sum(map(self.serial_cycles_of, self.instructions))

    def serial_cycles_of(self, instruction: Instruction) -> int:
        """Clocks of an instruction, at most."""
        if instruction.opcode in PRODUCTS:
            return self.digit_bits + 1
        return serial_clocks(instruction.constant)

    def padded(self, count: int) -> Program:
        """Return the program with instructions that change nothing put before it, so that it has `count` of them.

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
            instructions=(*[self.nothing] * missing, *self.instructions),
            schedule=(*waiting, *((name, start + missing, count) for name, start, count in self.schedule)),
        )

    def with_wait(self) -> Program:
        """Return the program with an instruction that changes nothing put before its last one."""
        *schedule, (name, start, count) = self.schedule
        return replace(
            self,
            instructions=(*self.instructions[:-1], self.nothing, self.instructions[-1]),
            schedule=(*schedule, (name, start, count + 1)),
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
        flags = dict.fromkeys(Judged, False)
        acc = operand = 0
        for opcode, address, constant, target, second_address, second_constant in self.instructions:
            word = words[address]
            acc += word * (operand if opcode in PRODUCTS else constant)
            acc += words[second_address] * second_constant
            if opcode is not Opcode.TAKE and not -limit <= acc < limit:
                raise OverflowError(f"the accumulator must stay within {self.accumulator_bits} bits, not {acc}")
            if opcode is Opcode.TAKE:
                words[target] = supply[constant]
            elif opcode is Opcode.OPERAND:
                operand = word
            elif opcode is Opcode.MOVE:
                words[target] = word
            elif opcode in STORES:
                words[target] = acc % base
            elif opcode in FINISHES:
                words[target] = (acc + base) % (2 * base) - base
            elif opcode is Opcode.GIVE:
                code += (acc if target == self.output.parts - 1 else acc % base) << (self.digit_bits * target)
            elif opcode is Opcode.JUDGE:
                flags[Judged(target)] |= acc < 0
            acc = 0 if opcode in CLEARS else acc >> self.digit_bits if opcode in CARRIES else acc
            if not -base <= words[target] < base:
                raise OverflowError(f"a word must hold {self.digit_bits + 1} bits, not {words[target]}")
        return Sample(code, flags[Judged.OUTSIDE], flags[Judged.SETTLING])


def serial_clocks(factor: int) -> int:
    """Clocks of a multiplication by a constant that takes one for each bit of the factor."""
    return max(factor.bit_length(), 1) if factor >= 0 else (-factor - 1).bit_length() + 1


def digits_of(code: int, count: int, digit_bits: int) -> list[int]:
    """Split `code` into `count` digits, the lowest first; only the top one has a sign."""
    low = [(code >> (digit_bits * k)) & ((1 << digit_bits) - 1) for k in range(count - 1)]
    return [*low, code >> (digit_bits * (count - 1))]
