"""Transfers on an AXI4-Stream, as arrays and in a file.

A signal of up to 64 bits is a column of words; a wider one has several words for each transfer, the lowest first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class Beats:
    """Transfers on an AXI4-Stream, in order; all arrays have shape (n,), or (n, words) for more than 64 bits.

    Attributes
    ----------
    tdest : ndarray of int64
        Channel; 0 on a stream without ``tdest``.
    tdata : ndarray of uint64
        The bus word.
    tuser : ndarray of uint64
        Status of each sample, a byte each; 0 on a stream without ``tuser``.
    """

    tdest: npt.NDArray[np.int64]
    tdata: npt.NDArray[np.uint64]
    tuser: npt.NDArray[np.uint64]

    def __len__(self) -> int:
        """Count the transfers."""
        return len(self.tdata)

    def results(self, samples: int, copies: int, rates: Sequence[Sequence[int]] = ()) -> int:
        """Count what comes out: of each channel, for its first transfer and each group of `samples`, its copies.

        With `rates`, those of a chain's stages, by how much each interpolates and decimates, in order.
        """
        counts = np.bincount(self.tdest) if len(self) else np.zeros(0, dtype=np.int64)
        for rise, factor in rates:
            counts = -(-counts * rise // factor)
        return int((-(-counts // (1 if rates else samples))).sum()) * copies

    def first(self, count: int) -> Beats:
        """Return a view of the first `count` transfers, or of all if there are fewer."""
        return Beats(self.tdest[:count], self.tdata[:count], self.tuser[:count])

    def same_as(self, other: Beats) -> bool:
        """Tell whether all transfers are equal."""
        return all(
            np.array_equal(mine, theirs)
            for mine, theirs in ((self.tdest, other.tdest), (self.tdata, other.tdata), (self.tuser, other.tuser))
        )

    def save(self, path: Path) -> None:
        """Write to a file; of a column of zeros, only its shape."""
        with path.open("wb") as file:
            for column in (self.tdest, self.tdata, self.tuser):
                np.save(file, np.array(column.shape))
                np.save(file, column if column.any() else column[:0])

    @staticmethod
    def load(path: Path) -> Beats:
        """Read a file that `save` has written."""

        def column(file: BinaryIO) -> npt.NDArray[Any]:
            shape, values = tuple(np.load(file).tolist()), np.load(file)
            # Zeros that nobody writes to take no memory.
            return values if values.shape == shape else np.zeros(shape, values.dtype)

        with path.open("rb") as file:
            return Beats(column(file), column(file), column(file))

    @staticmethod
    def zeros(count: int, data_bits: int = 64, user_bits: int = 64) -> Beats:
        """Make `count` transfers of zeros, to be filled, with so many bits at most."""
        return Beats(np.zeros(count, np.int64), _zeros(count, data_bits), _zeros(count, user_bits))

    def numbers(self) -> list[tuple[int, int, int]]:
        """Return ``tdest``, ``tdata`` and ``tuser`` of each transfer as whole numbers."""
        return list(zip(self.tdest.tolist(), _numbers(self.tdata), _numbers(self.tuser), strict=True))

    def put(self, index: int, tdest: int, tdata: int, tuser: int) -> None:
        """Store a transfer in these arrays."""
        self.tdest[index] = tdest
        for column, number in ((self.tdata, tdata), (self.tuser, tuser)):
            words = column[index : index + 1].reshape(-1)  # a view
            words[:] = [number >> 64 * k & _WORD for k in range(len(words))]


_WORD = (1 << 64) - 1


def _zeros(count: int, bits: int) -> npt.NDArray[np.uint64]:
    return np.zeros(count if bits <= 64 else (count, -(-bits // 64)), np.uint64)


def _numbers(column: npt.NDArray[np.uint64]) -> list[int]:
    rows = column.reshape(len(column), -1).tolist()
    return [sum(int(word) << 64 * k for k, word in enumerate(row)) for row in rows]
