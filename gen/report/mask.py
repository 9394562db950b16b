"""Whether a filter with integer coefficients meets the mask of its specification."""

from __future__ import annotations

from sosmith.gen.filter.response import MASK_TOLERANCE_DB, FilterFacts, ResponseMeasures
from sosmith.gen.quantity import plain_number


def mask_shortfalls(facts: FilterFacts, measures: ResponseMeasures) -> list[str]:
    """Say in one sentence each where the quantized response misses the specification's mask.

    A miss of at most `MASK_TOLERANCE_DB` counts as met, for the reason given there. A filter whose largest
    pole radius is 1 or more has no frequency response to speak of, and misses whatever the mask.
    """
    shortfalls = []
    if measures.largest_pole_radius >= 1:
        radius = plain_number(measures.largest_pole_radius, 6)
        shortfalls.append(f"The filter with its integer coefficients is unstable: a pole lies at radius {radius}.")
    if facts.passband_edge and facts.passband_loss is not None:
        if measures.passband_loss_db > facts.passband_loss + MASK_TOLERANCE_DB:
            shortfalls.append(
                f"The passband loss is {measures.passband_loss_db:.4f} dB, "
                f"more than the {facts.passband_loss:g} dB allowed."
            )
        if measures.passband_gain_db > MASK_TOLERANCE_DB:
            shortfalls.append(
                f"The passband rises {measures.passband_gain_db:.4f} dB above the level of the ideal filter."
            )
    attenuation = measures.stopband_attenuation_db
    asked = facts.stopband_loss if facts.stopband_edge else None
    if asked is not None and attenuation is not None and attenuation < asked - MASK_TOLERANCE_DB:
        shortfalls.append(f"The stopband attenuation is {attenuation:.3f} dB, less than the {asked:g} dB asked for.")
    return shortfalls
