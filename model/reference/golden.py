"""The golden model: what the core should compute, in double precision with unquantized coefficients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sosmith.model.arithmetic.recursive_filters import dc_gain, sosfilt
from sosmith.model.arrays import Codes, Values
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port

BLOCK = 1 << 18
"""Samples that are computed at a time: the steps between codes and results take memory for so many, not for all."""


def exact_chain(
    codes: Codes, datapath: Datapath, polynomial: Polynomial | None, sos: Values | None, *, steady: bool
) -> Values:
    """Compute what the hardware of `datapath` approximates: calibration, decimator and filter from the input codes.

    Returns an array of shape (results, channels), limited to the range of the output.

    Parameters
    ----------
    codes : int64 array, shape (samples, channels, inputs)
        Input codes.
    datapath : Datapath
        Whose ports and decimator count.
    polynomial, sos, steady
        As for `calibrated` and `filtered`.
    """
    factor, down = datapath.samples_per_result, datapath.downsampler
    golden = np.empty((datapath.results(len(codes)), codes.shape[1]))
    for k in range(codes.shape[1]):
        # A decimator's sums reach over all samples; what it leaves is fewer.
        size = BLOCK if datapath.decimator is None else max(len(codes), 1)
        filtering = Filtering(sos, datapath.output, steady=steady)
        for first in range(0, len(codes), size):
            entering = entering_filter(codes[first : first + size, k], datapath, polynomial)
            results = filtering(entering)
            start = first
            if down is not None:
                results, start = results[-first % factor :: factor], -(-first // factor)
            golden[start : start + len(results), k] = results
    return golden


def exact_before_filter(codes: Codes, datapath: Datapath, polynomial: Polynomial | None) -> Values:
    """Compute the calibration alone at the samples that bring a result, shape (results, channels)."""
    codes = codes[:: datapath.samples_per_result]
    values = np.empty(codes.shape[:2])
    for k in range(codes.shape[1]):
        for start in range(0, len(codes), BLOCK):
            block = slice(start, start + BLOCK)
            values[block, k] = calibrated(codes[block, k], datapath.inputs, polynomial)
    return values


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
    if datapath.calibration is not None:
        values = calibrated(codes, datapath.inputs, polynomial)
        for _ in range(decimator.factor.bit_length() - 1):
            for _ in range(decimator.stages):
                before = values[:1] if decimator.steady else np.full(len(values[:1]), float(decimator.input.zero))
                values = (values + np.concatenate([before, values[:-1]])) / 2
            values = values[::2]
        return values
    unrounded = replace(decimator, dropped=0)
    return float(unrounded.input.zero) + float(unrounded.lsb) * unrounded.compute(codes[:, 0]).astype(np.float64)


def filtered(values: Values, sos: Values | None, output: Port, *, steady: bool = False) -> Values:
    """Filter all `values` at once, as `Filtering` does."""
    return Filtering(sos, output, steady=steady)(values)


class Filtering:
    """Filters values block by block, and limits the results to the range of the output.

    Parameters
    ----------
    sos : float array, shape (sections, 2 * (order + 1)), or None
        Sections of the ideal filter, as for `sosfilt`; None for no filter.
    output : Port
        Output port, whose range limits the result.
    steady : bool
        Whether the filter starts from the steady state of the first value, and not from zero.
    """

    def __init__(self, sos: Values | None, output: Port, *, steady: bool = False) -> None:
        self._sos, self._steady = sos, steady
        self._range = output.decode(np.array([output.lowest, output.highest]))
        self._states = None if sos is None else np.zeros((len(sos), sos.shape[1] // 2 - 1))
        self._first: float | None = None

    def __call__(self, values: Values) -> Values:
        """Filter the next physical values, shape (samples,)."""
        sos = self._sos
        if self._first is None:
            self._first = values[0] if self._steady and sos is not None and len(values) else 0.0
        result = values if sos is None else sosfilt(sos, values - self._first, self._states)
        if sos is not None and self._first:
            result = result + dc_gain(sos) * self._first
        return np.clip(result, *self._range)
