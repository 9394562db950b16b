"""What stands before a decimated filter, and what it leaves for the filter to do."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction

from sosmith.gen.filter.decimation import Decimation, choose, decimated
from sosmith.gen.filter.design import Filter
from sosmith.gen.specification.specification import FilterSpec
from sosmith.gen.word_lengths.quantize import gain_of
from sosmith.gen.word_lengths.quantized import DECIMATION, Quantized
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.decimator import Decimator
from sosmith.model.errors import ShortfallError
from sosmith.model.port import Port

_SHARE = Fraction(1, 32)
"""Share of the error allowed that the rounding behind the decimator takes: bits there cost little."""

_LARGEST_SHARE = Fraction(1, 2)
"""The same where the filter's input would be too wide."""

_MAX_BITS = 32
"""Widest input of a filter."""


@dataclass(frozen=True, kw_only=True)
class Front:
    """A decimator, the filter behind it, and why they are so.

    Attributes
    ----------
    decimation : Decimation
        Factor, stages, and their response.
    decimator : Decimator
        The same as integers.
    filter : Filter
        The filter at the lower rate, with the correction of the decimator's droop.
    error : Fraction
        Bound on what the rounding behind the decimator changes at the output, in output LSBs.
    reason : str
        A sentence.
    """

    decimation: Decimation
    decimator: Decimator
    filter: Filter
    error: Fraction
    reason: str

    def before(self, datapath: Datapath) -> Datapath:
        """Return the datapath of the filter with the decimator before it."""
        return replace(datapath, inputs=(self.decimator.input,), calibrated=(), decimator=self.decimator)

    def counted(self, quantized: Quantized) -> Quantized:
        """Return the proven filter with the decimator's part in its budget."""
        budget = {DECIMATION: self.error, **quantized.budget} if self.error else quantized.budget
        return replace(quantized, budget=budget, decimation=self.decimation)


def front_of(
    spec: FilterSpec, sample_rate: Fraction, x: Port, output: Port, max_error: Fraction
) -> tuple[Front | None, str]:
    """Choose the decimator before a filter.

    Parameters
    ----------
    spec : FilterSpec
        A low-pass filter by order and cutoff, with `decimate`.
    sample_rate : Fraction
        Of the input, in Hz.
    x, output : Port
        Input and output.
    max_error : Fraction
        Error allowed, in the unit of both.

    Returns
    -------
    Front or None
        None if "auto" finds that none is better than to filter all samples.
    str
        Why.

    Raises
    ------
    ShortfallError
        If the factor that is asked for lets too much fold into the pass band, or its filter takes too many bits.
    """
    # A sine of the largest amplitude that the input can have, as far as it folds, must not exceed the error allowed.
    amplitude = x.lsb * (x.highest - x.lowest) / 2
    found, reason = choose(spec, sample_rate, max_error / amplitude, x.bits)
    if found is None:
        return None, reason
    filter_ = decimated(spec, found)
    gain = gain_of(filter_)
    allowed = max_error / output.lsb - Fraction(1, 2)
    whole = Decimator(input=x, factor=found.factor, stages=found.stages, dropped=0)
    # LSBs of the output that a rounding costs which drops so many bits: halved with each bit that it keeps.
    coarsest = gain * x.lsb / output.lsb / 2
    kept = (math.ceil(coarsest / (allowed * _SHARE)) - 1).bit_length()
    kept = min(kept, whole.growth, _MAX_BITS - x.bits)
    decimator = replace(whole, dropped=whole.growth - kept)
    error = gain * decimator.rounding / output.lsb
    if error > allowed * _LARGEST_SHARE:
        raise ShortfallError(
            f"the rounding behind the decimator must take at most half of the error allowed, not {float(error):.3g} "
            f"output LSB with {decimator.output.bits} bits: raise output.max_error or output.bits"
        )
    return Front(decimation=found, decimator=decimator, filter=filter_, error=error, reason=reason), reason
