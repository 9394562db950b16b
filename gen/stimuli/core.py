"""What stimuli need to know of a core: its ports, and its responses to the input and to every quantizer."""

from __future__ import annotations

import numpy as np

from sosmith.gen.core import CoreDesign
from sosmith.gen.stimuli.run import Bench
from sosmith.gen.word_lengths.error_paths import error_responses


def bench_of(design: CoreDesign, *, errors: bool = True) -> Bench:
    """Return the properties of a core that scenarios depend on; one alone needs the responses to `errors`."""
    quantized, decimator = design.quantized, design.datapath.decimator
    response = np.ones(1) if quantized.filter is None else quantized.filter.impulse_response
    responses = tuple(error_responses(quantized)) if errors else ()
    if decimator is not None:  # as the input sees them, at the higher rate
        response, responses = decimator.before(response), tuple(map(decimator.before, responses))
    return Bench(
        ports=design.datapath.inputs,
        output=design.datapath.output,
        sample_rate=design.spec.sample_rate,
        polynomial=quantized.polynomial,
        impulse_response=response,
        error_responses=responses,
    )
