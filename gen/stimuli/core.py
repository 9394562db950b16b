"""What stimuli need to know of a core: its ports, and its responses to the input and to every quantizer."""

from __future__ import annotations

import numpy as np

from sosmith.gen.core import CoreDesign, chosen_core, inputs_of, response_of
from sosmith.gen.specification.specification import Specification
from sosmith.gen.stimuli.error_paths import error_responses
from sosmith.gen.stimuli.run import Bench


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


def bench_before(spec: Specification, core: str | None = None) -> Bench:
    """Return the same before there is a design, from the specification alone, but for the responses to errors.

    Raises
    ------
    SpecificationError, ShortfallError
        If the specification has no such core, or its filter cannot be designed.
    """
    kind = chosen_core(spec, core)
    response, _ = response_of(spec, kind)
    impulse_response = np.ones(1) if response.ideal is None else response.ideal.impulse_response
    return Bench(
        ports=inputs_of(spec, kind),
        output=spec.output,
        sample_rate=spec.sample_rate,
        polynomial=response.polynomial,
        impulse_response=impulse_response
        if response.pre_stage is None
        else response.pre_stage.decimator.before(impulse_response),
    )
