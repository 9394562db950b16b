"""Makes the last stage of a datapath, and bounds its error."""

from __future__ import annotations

from fractions import Fraction

from sosmith.model.dataflow.graph import Range
from sosmith.model.port import Port
from sosmith.model.sections.output import FirstSample, OutputStage


def output_stage(x: Range, output: Port, first_sample: FirstSample | None = None) -> tuple[OutputStage, Fraction]:
    """Make the last stage for a result in `x`, and bound its error in output LSBs.

    The error is half an LSB if anything is rounded, plus the rounding error of the offset. A first sample is added
    exactly, with its gain.
    """
    frac = max(x.frac, 0 if first_sample is None else first_sample.range.frac + first_sample.gain_frac, 0)
    exact = -output.zero / output.lsb * 2**frac
    offset = round(exact)
    rounding = Fraction(1, 2) if frac > 0 else Fraction(0)
    stage = OutputStage(
        offset=offset,
        offset_frac=frac,
        x=x,
        low=output.lowest,
        high=output.highest,
        held=first_sample,
    )
    return stage, rounding + abs(exact - offset) / 2**frac
