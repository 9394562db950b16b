"""Transfers on an AXI4-Stream, as arrays and in a file."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class Beats:
    """Transfers on an AXI4-Stream, in order; all arrays have shape (n,).

    Attributes
    ----------
    tdest : ndarray of int64
        Channel; 0 on a stream without ``tdest``.
    tdata : ndarray of uint64
        The bus word.
    tuser : ndarray of uint8
        Status; 0 on a stream without ``tuser``.
    """

    tdest: npt.NDArray[np.int64]
    tdata: npt.NDArray[np.uint64]
    tuser: npt.NDArray[np.uint8]

    def __len__(self) -> int:
        """Count the transfers."""
        return len(self.tdata)

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
        """Write to a file."""
        content = io.BytesIO()
        for column in (self.tdest, self.tdata, self.tuser):
            np.save(content, column)
        path.write_bytes(content.getvalue())

    @staticmethod
    def load(path: Path) -> Beats:
        """Read a file that `save` has written."""
        with path.open("rb") as file:
            return Beats(*(np.load(file) for _ in range(3)))

    @staticmethod
    def zeros(count: int) -> Beats:
        """Make `count` transfers of zeros, to be filled."""
        return Beats(np.zeros(count, np.int64), np.zeros(count, np.uint64), np.zeros(count, np.uint8))
