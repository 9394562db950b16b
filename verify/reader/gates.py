"""Gates of two inputs, each of which is there once: what is built alike from alike is the same literal.

A literal is twice the number of a gate or variable, and one more if it is inverted. 0 and 1 are the constants. Words
are lists of literals, the lowest bit first. Equal literals are equal functions; the reverse holds only as far as the
rules in `Gates.both` go.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence

from sosmith.verify.graph import require

_WIDEST = 512
"""Bits of a factor that is taken apart into gates."""

Word = list[int]
"""The literals of a word, the lowest bit first."""

LOW, HIGH = 0, 1
"""The constants."""


class Gates:
    """A growing set of gates and variables."""

    def __init__(self) -> None:
        self._inputs: list[tuple[int, int] | None] = [None]
        self._known: dict[Hashable, int] = {}

    def variable(self, key: Hashable) -> int:
        """Return the variable of this key, which is not a pair of integers."""
        return self._literal(key, None)

    def _literal(self, key: Hashable, inputs: tuple[int, int] | None) -> int:
        literal = self._known.get(key)
        if literal is None:
            literal = self._known[key] = 2 * len(self._inputs)
            self._inputs.append(inputs)
        return literal

    def inputs(self, literal: int) -> tuple[int, int] | None:
        """Return the literals that the gate of a literal takes; None for a variable or constant."""
        return self._inputs[literal >> 1]

    # Gates.

    def both(self, a: int, b: int) -> int:
        """Return whether both are 1."""
        for one, other in ((a, b), (b, a)):
            if one in {HIGH, other}:
                return other
            if one in {LOW, other ^ 1}:
                return LOW
        for one, other in ((a, b), (b, a)):
            inputs = self._inputs[one >> 1]
            if inputs is not None:
                if one & 1 == 0:  # c & d with c is itself, with not c it is 0
                    if other in inputs:
                        return one
                    if other ^ 1 in inputs:
                        return LOW
                elif other ^ 1 in inputs:  # not (c & d) with not c is not c
                    return other
                elif other in inputs:  # not (c & d) with c is c & not d
                    return self.both(other, inputs[inputs[0] == other] ^ 1)
        pair = (a, b) if a < b else (b, a)
        return self._literal(pair, pair)

    def either(self, a: int, b: int) -> int:
        """Return whether one is 1, or both."""
        return self.both(a ^ 1, b ^ 1) ^ 1

    def chosen(self, select: int, yes: int, no: int) -> int:
        """Return `yes` or `no`."""
        if yes == no:
            return yes
        if yes & 1:
            return self.chosen(select, yes ^ 1, no ^ 1) ^ 1
        return self.either(self.both(select, yes), self.both(select ^ 1, no))

    def differ(self, a: int, b: int) -> int:
        """Return whether two bits differ."""
        inverted, (low, high) = (a ^ b) & 1, sorted((a & ~1, b & ~1))
        return self.chosen(low, high ^ 1, high) ^ inverted

    def all_of(self, word: Sequence[int]) -> int:
        """Return whether all bits are 1."""
        conjunction = HIGH
        for bit in word:
            conjunction = self.both(conjunction, bit)
        return conjunction

    def any_of(self, word: Sequence[int]) -> int:
        """Return whether a bit is 1."""
        return self.all_of([bit ^ 1 for bit in word]) ^ 1

    def parity_of(self, word: Sequence[int]) -> int:
        """Return whether the number of ones is odd."""
        parity = LOW
        for bit in word:
            parity = self.differ(parity, bit)
        return parity

    # Words; where there are two, they have one width.

    def sum_of(self, a: Word, b: Word, carry: int = LOW) -> Word:
        """Return a sum without its carry."""
        total = []
        for one, other in zip(a, b, strict=True):
            low, high = sorted((one, other))
            half = self.differ(low, high)
            total.append(self.differ(half, carry))
            carry = self.chosen(half, carry, low)
        return total

    def difference_of(self, a: Word, b: Word) -> Word:
        """Return a difference without its borrow."""
        return self.sum_of(a, [bit ^ 1 for bit in b], HIGH)

    def product_of(self, a: Word, b: Word) -> Word:
        """Return as many bits of a product as the factors have."""
        require(len(a) <= _WIDEST, f"a product must have at most {_WIDEST} bits to be compared, not {len(a)}")
        first, second = sorted((a, b))
        total: Word = [LOW] * len(a)
        for place, bit in enumerate(second):
            if bit != LOW:
                rest = [self.both(bit, one) for one in first[: len(a) - place]]
                total[place:] = self.sum_of(total[place:], rest)
        return total

    def equal(self, a: Word, b: Word) -> int:
        """Return whether two words are equal."""
        return self.any_of([self.differ(one, other) for one, other in zip(a, b, strict=True)]) ^ 1

    def less(self, a: Word, b: Word, *, signed: bool) -> int:
        """Return whether a word is less than another one."""
        less = LOW
        if signed:  # as words without sign whose highest bits are inverted
            a, b = ([*word[:-1], word[-1] ^ 1] for word in (a, b))
        for one, other in zip(a, b, strict=True):
            less = self.chosen(self.differ(one, other), other, less)
        return less


def extended(word: Word, width: int, *, signed: bool) -> Word:
    """Return a word of another width: cut, or extended by zeros or the sign."""
    return [*word, *[word[-1] if signed else LOW] * (width - len(word))][:width]


def constant(value: int, width: int) -> Word:
    """Return a constant word."""
    return [value >> place & 1 for place in range(width)]
