"""Every N-th result alone, or all of them: the node DOWN behind a filter without recursion.

::

    x(0), x(1), ..  -->  FIR filter at the rate of the input  -->  DOWN: y(0), y(N), y(2 N), ..

Results between are never asked for, so that hardware need not compute them; each that leaves is one that the filter
has at the rate of the input, and all that is proven of those holds of these.

Started from its first sample, the filter works as if that had been there for ever: it goes in `filled` times before it
counts, after which all that the filter remembers is that sample.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

_Flags = TypeVar("_Flags", np.bool_, np.uint8)


@dataclass(frozen=True, kw_only=True)
class Downsampler:
    """What hands on every N-th result.

    Attributes
    ----------
    factor : int
        N; result n belongs to sample ``n N``. 1 for a filter all of whose results leave.
    filled : int
        Times that the first sample goes in before it counts; 0 for a start from zero.

    Examples
    --------
    >>> Downsampler(factor=3, filled=0).count(7)
    3
    """

    factor: int
    filled: int

    def __post_init__(self) -> None:
        if self.factor < 1:
            raise ValueError(f"factor must be at least 1, not {self.factor}")
        if self.filled < 0:
            raise ValueError(f"filled must not be negative, not {self.filled}")

    def count(self, samples: int) -> int:
        """Count the results of so many samples."""
        return -(-samples // self.factor)

    def preceded(self, block: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        """Return samples, shape (samples, ...), with the first of them as often before as it goes in."""
        return np.concatenate([np.repeat(block[:1], self.filled, axis=0), block])


def gathered(flags: npt.NDArray[_Flags], factor: int) -> npt.NDArray[_Flags]:
    """Return, for every `factor`-th sample, the bits set in any sample since the one before of these.

    Parameters
    ----------
    flags : array of bool or of an integer type, shape (samples,)
    factor : int
        Samples for each result.

    Examples
    --------
    >>> gathered(np.array([1, 0, 2, 0, 0], dtype=np.uint8), 3).tolist()
    [1, 2]
    """
    if not len(flags):
        return flags
    last = np.arange(-(-len(flags) // factor)) * factor
    of_results: npt.NDArray[_Flags] = np.bitwise_or.reduceat(flags[: last[-1] + 1], np.maximum(last - factor + 1, 0))
    return of_results
