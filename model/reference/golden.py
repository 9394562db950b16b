"""The golden chain: what the core should compute, in double precision with unquantized coefficients."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import signal

from sosmith.model.arrays import Codes, Values
from sosmith.model.calibration.polynomial import Polynomial
from sosmith.model.port import Port


def calibrated(codes: Codes, inputs: Sequence[Port], polynomial: Polynomial | None) -> Values:
    """Physical values before the filter.

    Parameters
    ----------
    codes : int64 array, shape (samples, inputs)
        Input codes.
    inputs : sequence of Port
        Their formats.
    polynomial : Polynomial or None
        Calibration; None where the one input is the quantity itself.
    """
    physical = [port.decode(codes[:, index]) for index, port in enumerate(inputs)]
    return physical[0] if polynomial is None else polynomial(*physical)


def filtered(values: Values, sos: Values | None, output: Port) -> Values:
    """`values` through the filter from rest, limited to the range of `output`.

    Parameters
    ----------
    values : float array, shape (samples,)
        Physical values.
    sos : float array, shape (sections, 6), or None
        The ideal filter; None for none.
    output : Port
        Where the result saturates.
    """
    result = values if sos is None else np.asarray(signal.sosfilt(sos, values), dtype=np.float64)
    low, high = output.decode(np.array([output.lowest, output.highest]))
    return np.clip(result, low, high)
