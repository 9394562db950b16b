"""What stands before a decimated filter, and what it leaves for the filter to do."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction

from sosmith.gen.filter.decimation import Decimation, choose, decimated
from sosmith.gen.filter.design import Filter
from sosmith.gen.specification.specification import FilterSpec
from sosmith.gen.word_lengths.decimation.calibration import calibration_before_decimator
from sosmith.gen.word_lengths.quantize import gain_of
from sosmith.gen.word_lengths.quantized import Quantized, counted
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.decimator import MAX_WIDTH, Decimator
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port

_SHARE = Fraction(1, 32)
"""Share of the error allowed that the rounding behind the decimator takes: bits there cost little."""

_LARGEST_SHARE = Fraction(1, 2)
"""The same where the filter's input would be too wide."""

_MAX_BITS = 32
"""Widest input of a filter."""

_CALIBRATION_SHARE = Fraction(1, 4)
"""Share of the error allowed that a calibration before the decimator takes."""

_GUESSED_GAIN = 4
"""Peak gain of a filter that is not chosen yet, to guess the width of what the calibration gives to the decimator."""


@dataclass(frozen=True, kw_only=True)
class PreStage:
    """A decimator, what stands before it, the filter behind it, and why they are so.

    Attributes
    ----------
    decimation : Decimation
        Factor, stages, and their response.
    decimator : Decimator
        The same as integers.
    filter : Filter
        The filter at the lower rate, with the correction of the decimator's droop.
    output : Port
        What leaves the filter.
    rounding : Fraction
        Bound on what the rounding behind the decimator changes at the output, in output LSBs.
    calibration : Quantized or None
        What stands before the decimator; None if that takes the input itself.
    gain : Fraction
        Worst-case peak gain of the filter. That of the decimator is 1.
    reason : str
        A sentence.
    """

    decimation: Decimation
    decimator: Decimator
    filter: Filter
    output: Port
    rounding: Fraction
    calibration: Quantized | None
    gain: Fraction
    reason: str

    @property
    def input_error(self) -> Fraction:
        """Bound on the error of the calibration, at the filter's input as at its own output, in output LSBs."""
        return Fraction(0) if self.calibration is None else self.calibration.bound * self._step

    @property
    def error(self) -> Fraction:
        """Bound on what decimator and calibration change at the output, in output LSBs."""
        return self.rounding + self.input_error * self.gain

    @property
    def _step(self) -> Fraction:
        """LSB of what the calibration gives, in output LSBs."""
        assert self.calibration is not None
        return self.calibration.datapath.output.lsb / self.output.lsb

    def calibration_datapath(self, calibrated: tuple[tuple[int, int], ...]) -> Datapath | None:
        """Return the calibration before the decimator, with the codes that its measurements covered."""
        return None if self.calibration is None else replace(self.calibration.datapath, calibrated=calibrated)

    def before(self, datapath: Datapath, calibrated: tuple[tuple[int, int], ...]) -> Datapath:
        """Return the datapath of the filter with the decimator, and the calibration if there is one, before it."""
        calibration = self.calibration_datapath(calibrated)
        inputs, codes = (
            ((self.decimator.input,), ()) if calibration is None else (calibration.inputs, calibration.calibrated)
        )
        return replace(datapath, inputs=inputs, calibrated=codes, decimator=self.decimator, calibration=calibration)

    def counted(self, quantized: Quantized) -> Quantized:
        """Return the proven filter with the parts of decimator and calibration in its budget."""
        return counted(quantized, self.gain, self.decimation, self.decimator, self.calibration)


def pre_stage_of(
    spec: FilterSpec,
    sample_rate: Fraction,
    inputs: tuple[Port, ...],
    output: Port,
    max_error: Fraction,
    polynomial: Polynomial | None = None,
    name: str = "calibration",
    *,
    steady: bool = True,
) -> tuple[PreStage | None, str]:
    """Choose the decimator before a filter.

    Parameters
    ----------
    spec : FilterSpec
        A low-pass filter by order and cutoff, with `decimate`.
    sample_rate : Fraction
        Of the input, in Hz.
    inputs : tuple of Port
        One input, or those of the calibration.
    output : Port
        Output.
    max_error : Fraction
        Error allowed, in the unit of the output.
    polynomial : Polynomial or None
        Calibration; None if the decimator takes the input itself, which then has the unit of the output.
    name : str
        Name of the core of the calibration.
    steady : bool
        Whether the first sample counts as if it had been there for ever.

    Returns
    -------
    PreStage or None
        None if "auto" finds that none is better than to filter all samples.
    str
        Why.

    Raises
    ------
    ShortfallError
        If the factor that is asked for lets too much fold into the pass band, its filter takes too many bits, or so
        does the calibration.
    """
    allowed = max_error / output.lsb - Fraction(1, 2)

    def calibration(gain: Fraction) -> Quantized | None:
        if polynomial is None:
            return None
        return calibration_before_decimator(name, inputs, polynomial, output, allowed * _CALIBRATION_SHARE / gain)

    guessed = calibration(Fraction(_GUESSED_GAIN))
    x = inputs[0] if guessed is None else guessed.datapath.output
    # A sine over all that the decimator can take, as far as it folds, must not exceed the error allowed. A calibration
    # may give a constant.
    low, high = (x.lowest, x.highest) if guessed is None else guessed.datapath.result_range
    amplitude = x.lsb * (high - low) / 2
    decimation, reason = choose(spec, sample_rate, max_error / amplitude if amplitude else Fraction(1), x.bits)
    if decimation is None:
        return None, reason
    filter_ = decimated(spec, decimation)
    gain = gain_of(filter_)
    before = calibration(gain)
    x = inputs[0] if before is None else before.datapath.output
    coarsest = gain * x.lsb / output.lsb / 2
    decimator = replace(_rounded(x, decimation, coarsest=coarsest, allowed=allowed), steady=steady)
    rounding = gain * decimator.rounding / output.lsb
    if rounding > allowed * _LARGEST_SHARE:
        raise ShortfallError(
            f"the rounding behind the decimator must take at most half of the error allowed, not {float(rounding):.3g} "
            f"output LSB with {decimator.output.bits} bits: raise output.max_error or output.bits"
        )
    pre_stage = PreStage(
        decimation=decimation,
        decimator=decimator,
        filter=filter_,
        output=output,
        rounding=rounding,
        calibration=before,
        gain=gain,
        reason=reason,
    )
    return pre_stage, reason


def _rounded(x: Port, decimation: Decimation, *, coarsest: Fraction, allowed: Fraction) -> Decimator:
    """Return the decimator of `x` with a rounding that takes a small share of the error allowed, in output LSBs.

    A rounding to the steps of `x` would take `coarsest`; that is halved with each bit that it keeps.

    Raises
    ------
    ShortfallError
        If its registers would be too wide.
    """
    width = x.bits + decimation.stages * (decimation.factor.bit_length() - 1)
    if width > MAX_WIDTH:
        raise ShortfallError(
            f"the registers of the decimator must have at most {MAX_WIDTH} bits, not {width}: lower filter.decimate"
        )
    whole = Decimator(input=x, factor=decimation.factor, stages=decimation.stages, dropped=0)
    kept = (math.ceil(coarsest / (allowed * _SHARE)) - 1).bit_length()
    kept = min(kept, whole.growth, _MAX_BITS - x.bits)
    return replace(whole, dropped=whole.growth - kept)
