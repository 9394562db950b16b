"""A design in another realization with the same word lengths, to compare structures."""

from __future__ import annotations

from dataclasses import replace

from sosmith.gen.word_lengths.cascade import cascade, chosen_formats
from sosmith.gen.word_lengths.output_stage import output_stage
from sosmith.gen.word_lengths.quantized import Quantized, beside, filter_budget


def with_realization(quantized: Quantized, realization: str) -> Quantized:
    """Return the design in another realization from `ERROR_FEEDBACK`, with the same word lengths.

    The bound is proven again and may exceed the limit in the specification.
    """
    ideal = quantized.filter
    assert ideal is not None
    (x,) = quantized.sections[0].graph.input_ranges
    formats = chosen_formats(quantized.sections)
    sections, proof = cascade(ideal, realization, formats, x, steady=quantized.steady)
    (y,) = sections[-1].graph.output_ranges
    last, error = output_stage(y, quantized.datapath.output, quantized.first_sample)
    *stages, _ = quantized.datapath.stages
    passing = beside(sections, quantized.first_sample)
    return replace(
        quantized,
        datapath=replace(quantized.datapath, stages=(*stages[: -len(sections)], *passing, last)),
        realization=realization,
        budget=quantized.budget | filter_budget(proof) | {"output rounding": error},
        proof=proof,
    )
