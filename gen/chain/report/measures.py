"""Measures of a chain's exact response that stand beside those of a single filter: losses, aliases, delay."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.chain.ideal import chain_gain, level
from sosmith.gen.chain.specification import ChainSpec
from sosmith.gen.filter.decimation import group_delay
from sosmith.gen.specification.values import number
from sosmith.model.arrays import Values

_POINTS = 8001


def response_entry(design: ChainDesign) -> dict[str, float | None]:
    """Measure the gain from end to end in the pass band and in the stop band, in dB, at even steps.

    The pass band is that of the chain. The stop band begins at that of the limits, or else at the lowest one of a
    low-pass stage, and reaches to half the highest rate; a chain that decimates and then interpolates has none.
    """
    spec = design.spec
    measured: dict[str, float | None] = {"stopband_attenuation_db": None, "passband_loss_db": None}
    if spec.edge is None or not design.parts:
        return measured
    passing, stop = _levels(design, Fraction(0), spec.edge), _stop(spec)
    measured["passband_loss_db"] = float(passing.max() - passing.min())
    top = max(spec.base.sample_rate, *(stage.filter_rate for stage in spec.stages)) / 2
    if stop is not None and stop < top and len(design.foldings) < 2:
        measured["stopband_attenuation_db"] = float(passing.max() - _levels(design, stop, top).max())
    return measured


def _stop(spec: ChainSpec) -> Fraction | None:
    if spec.limits is not None and spec.span is None:
        return spec.limits.stopband_edge
    filters = [stage.tables["filter"] for stage in spec.stages]
    return min(
        (number(each["stopband_edge"]) for each in filters if "stopband_edge" in each and each["kind"] == "lowpass"),
        default=None,
    )


def _levels(design: ChainDesign, low: Fraction, high: Fraction) -> Values:
    return level(np.abs(chain_gain(design, np.linspace(float(low), float(high), _POINTS))))


def aliases_entry(design: ChainDesign) -> dict[str, float | None] | None:
    """Return the largest proven gains of aliases and images, in dB: of all, and in the pass band; None without any."""
    if not design.foldings:
        return None
    passing = [each.passing.gain for each in design.foldings if each.passing is not None]
    return {
        "anywhere_db": in_db(max(each.anywhere.gain for each in design.foldings)),
        "passband_db": in_db(max(passing)) if passing else None,
    }


def delay_entry(design: ChainDesign) -> dict[str, float] | None:
    """Return the group delay at zero frequency, in s, from end to end; None where constants do not pass."""
    seconds, rate = Fraction(0), design.spec.base.sample_rate
    if not design.parts or not all(sum(over) for part in design.parts for over, _ in part.sections):
        return None
    for part in design.parts:
        rate *= part.rise
        seconds += group_delay(part.sections) / rate
        rate /= part.factor
    return {"seconds": float(seconds), "frequency": 0.0}


def in_db(gain: Fraction) -> float | None:
    """Return a gain in dB; None for 0."""
    return 20 * math.log10(gain) if gain > 0 else None
