"""The first samples that a core with loadable constants may still hold when another set is loaded.

A filter that starts from its first sample holds it until the next reset, whatever is loaded in between, unless its core
restarts with what is loaded. With another
calibration, samples have another range, so a first sample may lie outside the range of those that follow. All sets that
are loaded without a reset must therefore keep their samples within one range, which is that of the hardware's own set
and a margin; what is proven of a swap holds for first samples anywhere in it.
"""

from __future__ import annotations

import math
from fractions import Fraction

from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.model.errors import ShortfallError
from sosmith.model.sections.start import StartStage

_MARGIN = Fraction(1, 4)
"""Share of the range of the samples by which it is widened at either end; none where no calibration is loaded."""

Limits = tuple[Fraction, Fraction]
"""Smallest and largest value, in output LSBs."""


def samples_of(quantized: Quantized) -> Limits:
    """Return the range of the samples of a design that starts from the first of them."""
    (stage,) = (stage for stage in quantized.datapath.stages if isinstance(stage, StartStage))
    return stage.x.limits


def first_samples(hardware: Quantized) -> Limits:
    """Return the range of the first samples that may be held, given the design of the hardware.

    A range that begins or ends at 0 or does not contain it stays on its side: hardware may have no sign bit.
    """
    low, high = samples_of(hardware)
    loads = hardware.polynomial is not None and hardware.calibration is None
    more = (high - low) * _MARGIN if loads else Fraction(0)
    zero = Fraction(0)
    return low - more if low < 0 else max(low - more, zero), high + more if high > 0 else min(high + more, zero)


def held_codes(quantized: Quantized, first_range: Limits) -> dict[str, tuple[int, int]]:
    """Return the codes of the signals of the start, by name, with first samples in a range."""
    (stage,) = (stage for stage in quantized.datapath.stages if isinstance(stage, StartStage))
    unit = Fraction(2) ** stage.x.frac
    low, high = math.floor(first_range[0] * unit), math.ceil(first_range[1] * unit)
    return {"held": (low, high), "change": (low - high, high - low)}


def check_samples(quantized: Quantized, first_range: Limits) -> None:
    """Check that the samples of a design stay within the range of first samples that may be held.

    Raises
    ------
    ShortfallError
        If they do not.
    """
    low, high = samples_of(quantized)
    if low < first_range[0] or high > first_range[1]:
        lsb, unit = quantized.datapath.output.lsb, f" {quantized.datapath.output.unit}".rstrip()
        ends, own = (tuple(float(end * lsb) for end in pair) for pair in (first_range, (low, high)))
        raise ShortfallError(
            f"the calibration's values must stay within {ends[0]:.6g}..{ends[1]:.6g}{unit}, the range of first samples "
            f"that may be held, not {own[0]:.6g}..{own[1]:.6g}: stop the samples and reset the core before the "
            "first one with the new set"
        )
