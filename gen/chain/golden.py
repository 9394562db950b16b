"""What a chain should compute, in double precision: its stages' exact filters in a row, limited at the end."""

from __future__ import annotations

import numpy as np

from sosmith.gen.chain.design import ChainDesign, StageDesign
from sosmith.gen.core import CoreDesign
from sosmith.model.arithmetic.recursive_filters import dc_gain, sosfilt
from sosmith.model.arrays import Codes, Values
from sosmith.model.dataflow.cic import impulse_response
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
    """Filter values and take every so many of the results.

    Before a start from the steady state, the first value was there for ever; before one from zero, there was 0.
    """
    if len(stage.cores) > 1:
        phases = [_of_core(core, values) for core in stage.cores]
        return np.stack(phases, axis=1).reshape(-1)
    return _of_core(stage.design, values)


def _of_core(core: CoreDesign, values: Values) -> Values:
    quantized, datapath = core.quantized, core.datapath
    if quantized.filter is None:
        return values
    decimator = datapath.decimator
    if decimator is not None:
        taps = np.array(impulse_response(decimator.factor, decimator.stages)) / float(
            decimator.factor**decimator.stages
        )
        past = values[0] if decimator.steady else float(decimator.input.zero)
        before = np.concatenate([np.full(len(taps) - 1, past), values])
        values = np.asarray(np.convolve(before, taps, mode="valid")[:: decimator.factor], dtype=np.float64)
    sos = quantized.filter.sos
    initial: float = values[0] if core.spec.hardware.start == "steady" else 0.0
    results = sosfilt(sos, values - initial, np.zeros((len(sos), sos.shape[1] // 2 - 1)))
    results = results + dc_gain(sos) * initial
    return results if decimator is not None else np.asarray(results[:: datapath.samples_per_result])
