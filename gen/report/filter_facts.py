"""The filter of a core as specified and as realized, for its measures and pictures."""

from __future__ import annotations

from sosmith.gen.filter.response import FilterFacts
from sosmith.gen.word_lengths.quantized import Quantized


def filter_facts(quantized: Quantized) -> FilterFacts | None:
    """Collect the facts about the filter of a core; None for a core without one."""
    ideal = quantized.filter
    if ideal is None:
        return None
    return FilterFacts(
        sample_rate=ideal.sample_rate,
        ideal_sos=ideal.sos,
        quantized_sos=quantized.quantized_sos,
        kind=ideal.kind,
        passband_edge=ideal.passband_edge,
        stopband_edge=ideal.stopband_edge,
        passband_loss=ideal.passband_loss,
        stopband_loss=ideal.stopband_loss,
        cutoff=ideal.cutoff,
        cutoff_of_stopband=ideal.cutoff_of_stopband,
    )
