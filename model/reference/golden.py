"""The golden model: what the core should compute, in double precision with unquantized coefficients."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import signal

from sosmith.model.arrays import Codes, Values
from sosmith.model.calibration.polynomial import Polynomial
from sosmith.model.port import Port


def calibrated(codes: Codes, inputs: Sequence[Port], polynomial: Polynomial | None) -> Values:
    """Return the physical values at the filter's input.

    Parameters
    ----------
    codes : int64 array, shape (samples, inputs)
        Input codes.
    inputs : sequence of Port
        Formats of the inputs.
    polynomial : Polynomial or None
        Calibration; None if the single input is the measured quantity itself.
    """
    physical = [port.decode(codes[:, index]) for index, port in enumerate(inputs)]
    return physical[0] if polynomial is None else polynomial(*physical)


def filtered(values: Values, sos: Values | None, output: Port) -> Values:
    """Filter `values` from zero state and limit the result to the range of `output`.

    Parameters
    ----------
    values : float array, shape (samples,)
        Physical values.
    sos : float array, shape (sections, 6), or None
        Second-order sections of the ideal filter; None for no filter.
    output : Port
        Output port, whose range limits the result.
    """
    result = values if sos is None else np.asarray(signal.sosfilt(sos, values), dtype=np.float64)
    low, high = output.decode(np.array([output.lowest, output.highest]))
    return np.clip(result, low, high)
