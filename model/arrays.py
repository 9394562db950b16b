"""The types of arrays that the code passes around."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Codes = npt.NDArray[np.int64]
"""Integer codes of a port."""

Values = npt.NDArray[np.float64]
"""Physical values, or any others in double precision."""
