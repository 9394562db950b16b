"""Check bits of a memory word: parity, or a code that corrects one wrong bit and detects two.

::

    data ----+---> word        word ---+---> data ---------------> xor ---> data
      bits   |    bits + check         |       bits                 ^
             +-> parities              +-> parities = syndrome -> column? -> corrected
                  check                      check         |
                                                           +--> no column, not 0 -> failed

Each check bit is the parity of some data bits; the set of check bits that a data bit belongs to is its column. The
columns are different and have an odd number of ones, so that one wrong bit has its own column for a syndrome, and two
have one with an even number of ones, which is nobody's column (M. Y. Hsiao, "A class of optimal minimum
odd-weight-column SEC-DED codes", IBM Journal of Research and Development, 1970).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from itertools import combinations
from operator import xor
from typing import NamedTuple

from amaranth.hdl import Cat, Const, Module, Signal, Value


class Read(NamedTuple):
    """A word that was read: its data, whether a wrong bit was corrected, and whether there is one that could not be."""

    data: Value
    corrected: Value
    failed: Value


class CheckBits:
    """The check bits of words of one width.

    Parameters
    ----------
    bits : int
        Width of the data, at least 1.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`.

    Attributes
    ----------
    width : int
        Width of the data with its check bits, which stand above it.

    Examples
    --------
    >>> [CheckBits(16, protect).width for protect in ("none", "detect", "correct")]
    [16, 17, 22]
    >>> bin(CheckBits(4, "detect").word(0b0111))
    '0b10111'
    """

    def __init__(self, bits: int, protect: str) -> None:
        self._bits = bits
        self._columns = _columns(bits, protect)
        self._corrects = protect == "correct"
        self._count = max(self._columns, default=0).bit_length()
        self.width = bits + self._count

    def word(self, data: int) -> int:
        """Return the word of `data`, a code of `bits` bits."""
        columns = [column for bit, column in enumerate(self._columns) if data >> bit & 1]
        return data | reduce(xor, columns, 0) << self._bits

    def written(self, data: Value) -> Value:
        """Return the word to write for `data`."""
        return Cat(data, *self._parities(list(data))) if self._count else data

    def read(self, m: Module, word: Value, name: str) -> Read:
        """Take a word apart that was read, with signals of the name `name` in the module `m`."""
        if not self._count:
            return Read(word, Const(0, 1), Const(0, 1))
        code = word.as_unsigned()
        pairs = zip(self._parities(list(code[: self._bits])), code[self._bits :], strict=True)
        syndrome = Signal(self._count, name=f"{name}_syndrome")
        m.d.comb += syndrome.eq(Cat(*(parity ^ check for parity, check in pairs)))
        if not self._corrects:
            return Read(code[: self._bits], Const(0, 1), syndrome.any())
        data = Signal(self._bits, name=f"{name}_corrected")
        m.d.comb += data.eq(code[: self._bits] ^ Cat(*(syndrome == column for column in self._columns)))
        return Read(data, syndrome.xor(), syndrome.any() & ~syndrome.xor())

    def _parities(self, data: Sequence[Value]) -> list[Value]:
        return [
            Cat(*(bit for bit, column in zip(data, self._columns, strict=True) if column >> check & 1)).xor()
            for check in range(self._count)
        ]


def _columns(bits: int, protect: str) -> list[int]:
    """Return the column of each data bit; those of the check bits themselves have a single one."""
    if protect == "none":
        return []
    if protect == "detect":
        return [1] * bits
    count = next(count for count in range(3, 64) if 2 ** (count - 1) - count >= bits)
    weights = range(3, count + 1, 2)
    every = (sum(1 << check for check in ones) for weight in weights for ones in combinations(range(count), weight))
    return [column for column, _ in zip(every, range(bits), strict=False)]
