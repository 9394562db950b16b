"""Impulse responses of a cascade in double precision, from every quantizer to the output.

What test signals are made from: the proof has its own, exact ones in `sosmith.gen.peak_gain`.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from sosmith.gen.design import impulse_response
from sosmith.gen.linear_model import linear_model
from sosmith.gen.quantize import Quantized

Array = npt.NDArray[np.float64]


def error_responses(quantized: Quantized) -> Iterator[Array]:
    """Impulse response from each quantizer's error to the cascade's output, in the order of the sections.

    Yields
    ------
    ndarray, shape (n,)
        Until what follows is below 1e-12 of the envelope; for an error and a response in output LSBs. Constants
        inside the sections count as quantizers.
    """
    sos = quantized.quantized_sos
    for index, section in enumerate(quantized.sections):
        model = linear_model(section.graph)
        after = sos[index:].copy()
        after[0, :3] = [1.0, 0.0, 0.0]
        poles_on = impulse_response(after)
        for source in model.sources[1:]:
            taps = np.array([float(value) for value in source.numerators[model.output]])
            yield np.convolve(poles_on, taps)
