"""What a chain should compute, in double precision: its stages' exact filters one behind the other, limited at the end."""

from __future__ import annotations

import numpy as np

from sosmith.gen.chain.design import ChainDesign, StageDesign
from sosmith.model.arithmetic.recursive_filters import dc_gain, sosfilt
from sosmith.model.arrays import Codes, Values
from sosmith.model.dataflow.decimator import impulse_response
from sosmith.model.reference.golden import calibrated


def golden_chain(design: ChainDesign, codes: Codes) -> Values:
    """Compute the exact results of input codes in double precision, shape (results, channels).

    Parameters
    ----------
    design : ChainDesign
    codes : integer array, shape (samples, channels, inputs)
    """
    ends = design.spec.base.output
    low, high = ends.decode(np.array([ends.lowest, ends.highest]))
    return np.stack([np.clip(_column(design, codes[:, k]), low, high) for k in range(codes.shape[1])], axis=1)


def _column(design: ChainDesign, codes: Codes) -> Values:
    first = design.stages[0].design
    values = calibrated(codes, first.datapath.inputs, first.quantized.polynomial)
    for stage in design.stages:
        values = _filtered(stage, values)
    return values


def _filtered(stage: StageDesign, values: Values) -> Values:
    """Filter values and take every so many of the results, as if the first value had been there for ever."""
    quantized, datapath = stage.design.quantized, stage.design.datapath
    if quantized.filter is None:
        return values
    decimator = datapath.decimator
    if decimator is not None:
        taps = np.array(impulse_response(decimator.factor, decimator.stages)) / float(decimator.factor**decimator.stages)
        before = np.concatenate([np.full(len(taps) - 1, values[0]), values])
        values = np.convolve(before, taps, mode="valid")[:: decimator.factor]
    sos = quantized.filter.sos
    results = sosfilt(sos, values - values[0], np.zeros((len(sos), sos.shape[1] // 2 - 1)))
    results = results + dc_gain(sos) * values[0]
    return results if decimator is not None else results[:: datapath.samples_per_result]
