"""The golden model: what the core should compute, in double precision with unquantized coefficients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sosmith.model.arithmetic.recursive_filters import sosfilt
from sosmith.model.arrays import Codes, Values
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port


@dataclass(frozen=True, eq=False)
class Exact:
    """What the exact chain makes of the input codes; both arrays have the shape (results, channels).

    Attributes
    ----------
    calibrated : ndarray
        The calibration alone, at the samples that bring a result.
    golden : ndarray
        Behind the filter too, limited to the range of the output.
    """

    calibrated: Values
    golden: Values


def exact_chain(
    codes: Codes, datapath: Datapath, polynomial: Polynomial | None, sos: Values | None, *, steady: bool
) -> Exact:
    """Compute what the hardware of `datapath` approximates: calibration, decimator and filter from the input codes.

    Parameters
    ----------
    codes : int64 array, shape (samples, channels, inputs)
        Input codes.
    datapath : Datapath
        Whose ports and decimator count.
    polynomial, sos, steady
        As for `calibrated` and `filtered`.
    """
    factor = 1 if datapath.decimator is None else datapath.decimator.factor
    channels = [codes[:, k] for k in range(codes.shape[1])]
    entering = [entering_filter(channel, datapath, polynomial) for channel in channels]
    golden = [filtered(column, sos, datapath.output, steady=steady) for column in entering]
    before = [calibrated(channel[::factor], datapath.inputs, polynomial) for channel in channels]
    return Exact(np.stack(before, axis=1), np.stack(golden, axis=1))


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


def entering_filter(codes: Codes, datapath: Datapath, polynomial: Polynomial | None) -> Values:
    """Return the physical values that the filter takes: those of `calibrated`, or what a decimator makes of them.

    A decimator of the input's codes computes in integers, and is exact before its rounding; only their conversion is in
    double precision. Behind a calibration, which stays in front of it, it is ``((1 + 1/z) / 2)**N`` again and again,
    each time at every other sample of the time before: no sum grows, and no difference cancels.

    Parameters
    ----------
    codes : int64 array, shape (samples, inputs)
        Input codes.
    datapath : Datapath
        Whose inputs and decimator count.
    polynomial : Polynomial or None
        As for `calibrated`.
    """
    decimator = datapath.decimator
    if decimator is None:
        return calibrated(codes, datapath.inputs, polynomial)
    if datapath.ahead is not None:
        values = calibrated(codes, datapath.inputs, polynomial)
        for _ in range(decimator.factor.bit_length() - 1):
            for _ in range(decimator.stages):  # the first sample as if it had been there for ever
                values = np.concatenate([values[:1], (values[1:] + values[:-1]) / 2])
            values = values[::2]
        return values
    unrounded = replace(decimator, dropped=0)
    return float(unrounded.input.zero) + float(unrounded.lsb) * unrounded.compute(codes[:, 0]).astype(np.float64)


def filtered(values: Values, sos: Values | None, output: Port, *, steady: bool = False) -> Values:
    """Filter `values` and limit the result to the range of `output`.

    Parameters
    ----------
    values : float array, shape (samples,)
        Physical values.
    sos : float array, shape (sections, 6), or None
        Second-order sections of the ideal filter; None for no filter.
    output : Port
        Output port, whose range limits the result.
    steady : bool
        Whether the filter starts from the steady state of the first value, and not from zero.
    """
    first = values[0] if steady and sos is not None and len(values) else 0.0
    result = values if sos is None else sosfilt(sos, values - first)
    if sos is not None and first:
        result = result + np.prod(sos[:, :3].sum(axis=1) / sos[:, 3:].sum(axis=1)) * first
    low, high = output.decode(np.array([output.lowest, output.highest]))
    return np.clip(result, low, high)
