"""The types of arrays that the code passes around."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
import numpy.typing as npt

Kind = TypeVar("Kind", bound=np.generic)

Codes = npt.NDArray[np.int64]
"""Integer codes of a port."""

Values = npt.NDArray[np.float64]
"""Physical values, or any others in double precision."""


def side_by_side(columns: Sequence[npt.NDArray[Kind]]) -> npt.NDArray[Kind]:
    """Stack arrays of equal shapes along a new second axis; a single one is not copied, as it may be large."""
    return columns[0][:, np.newaxis] if len(columns) == 1 else np.stack(columns, axis=1)
