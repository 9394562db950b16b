"""Runs a program on numbers, as the hardware does, many variants at once: to guess what it means, not to prove it.

Variants lie side by side in arrays of 64 bits. One that overflows them is wrong in any case.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from sosmith.verify.certificate_file import Certificate
from sosmith.verify.program.text import NUMBER_BITS, Instruction, ProgramText

_Integers = NDArray[np.int64]

Change = tuple[int, int]
"""Number of an instruction, and its code in a variant."""


def samples(certificate: Certificate, count: int) -> list[list[int]]:
    """Return codes of the inputs: the highest, then some that look random and are the same on every run."""
    seed = 1
    rows = [[port.highest for port in certificate.inputs]]
    for _ in range(count - 1):
        row = []
        for port in certificate.inputs:
            seed = (seed * 6364136223846793005 + 1442695040888963407) % 2**64
            row.append(port.lowest + (seed >> 32) % (port.highest - port.lowest + 1))
        rows.append(row)
    return rows


class Machine:
    """A program and variants of it that differ in one instruction each.

    Parameters
    ----------
    program : ProgramText
        The program.
    certificate : Certificate
        Its certificate, for the inputs.
    changes : sequence of Change
        One for each variant.

    Attributes
    ----------
    words : array, shape (words, variants)
        The memory.
    """

    def __init__(self, program: ProgramText, certificate: Certificate, changes: Sequence[Change] = ()) -> None:
        self._program, self._certificate = program, certificate
        self.changes = list(changes) or [(-1, 0)]
        self.words: _Integers = np.zeros((program.words, len(self.changes)), np.int64)
        self.words[-1] = 1

    def keep(self, which: NDArray[np.bool_]) -> None:
        """Drop all other variants."""
        self.words = self.words[:, which]
        self.changes = [change for change, kept in zip(self.changes, which.tolist(), strict=True) if kept]

    def step(self, codes: Sequence[int]) -> _Integers:
        """Run a sample; return the result of each variant before it is limited."""
        program, count = self._program, len(self.changes)
        changed: dict[int, list[tuple[int, int]]] = {}
        for variant, (number, code) in enumerate(self.changes):
            changed.setdefault(number, []).append((variant, code))
        digits = self._digits(codes)
        state = np.zeros((2 + len(program.results), count), np.int64)
        for number, instruction in enumerate(program.instructions):
            others = changed.get(number, ())
            which = [variant for variant, _ in others]
            before = self.words[:, which], state[:, which]
            self._execute(instruction, self.words, state, digits)
            if others:
                words, own = before
                for at, (_, code) in enumerate(others):
                    self._execute(program.decoded(code), words[:, at : at + 1], own[:, at : at + 1], digits)
                self.words[:, which], state[:, which] = words, own
        total = np.zeros(count, np.int64)
        for k, part in enumerate(state[2:]):
            total += part << (program.digit_bits * k)
        return total

    def _digits(self, codes: Sequence[int]) -> list[int]:
        """Return the digits of a sample; ports lie in whole bytes of the input stream, the first one lowest."""
        packed = offset = 0
        for port, code in zip(self._certificate.inputs, codes, strict=True):
            width = -(-port.bits // 8) * 8
            packed |= (code & ((1 << width) - 1)) << offset
            offset += width
        words = [
            sum((packed >> bit[1] & 1 if isinstance(bit, tuple) else bit or 0) << k for k, bit in enumerate(digit))
            for digit in self._program.digits
        ]
        return [word - (word >> self._program.digit_bits << (self._program.digit_bits + 1)) for word in words]

    def _execute(self, instruction: Instruction, words: _Integers, state: _Integers, digits: Sequence[int]) -> None:
        """Run an instruction; rows of `state` are accumulator, operand, and the digits given."""
        _, address, constant, target, second_address, second_constant = instruction
        program, end, (acc, operand, *given) = self._program, instruction.end, state
        bits, word = program.digit_bits, words[address].copy()
        acc += word * (operand if instruction.multiplies_words else constant) + words[second_address] * second_constant
        if end == "take":
            words[target] = digits[min(constant % (1 << NUMBER_BITS), len(digits) - 1)]
        elif end == "operand":
            operand[:] = word
        elif end == "move":
            words[target] = word
        elif end == "store":
            words[target] = acc & ((1 << bits) - 1)
        elif end == "finish":
            words[target] = _signed(acc, bits + 1)
        elif end == "give" and (part := program.part(target)) is not None:
            last = part == len(given) - 1
            given[part][:] = _signed(acc, program.results[part]) if last else acc & ((1 << bits) - 1)
        if end in {"store", "drop", "give"}:
            acc >>= bits
        elif end in {"finish", "judge", "take"}:
            acc[:] = 0


def _signed(value: _Integers, bits: int) -> _Integers:
    """Return the lowest bits of a value as a signed number."""
    return ((value + (1 << (bits - 1))) & ((1 << bits) - 1)) - (1 << (bits - 1))


def one_bit_away(
    program: ProgramText, certificate: Certificate, results: Sequence[int], suspects: Sequence[int]
) -> Iterator[Change]:
    """Yield the changes of one bit with which a program gives `results` for `samples`.

    If the program itself gives them, only changes of `suspects` are tried.
    """
    rows = samples(certificate, len(results))
    itself = Machine(program, certificate)
    right = all(int(itself.step(row)[0]) == result for row, result in zip(rows, results, strict=True))
    numbers = suspects if right else range(len(program.codes))
    machine = Machine(
        program, certificate, [(n, program.codes[n] ^ 1 << k) for n in numbers for k in range(program.code_bits)]
    )
    if not numbers:
        return
    for row, result in zip(rows, results, strict=True):
        machine.keep(machine.step(row) == result)
        if not machine.changes:
            return
    yield from machine.changes
