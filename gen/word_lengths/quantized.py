"""A frozen datapath with the proven bound on its error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import cast

import numpy as np
import numpy.typing as npt

from sosmith.gen.filter.decimation import Decimation
from sosmith.gen.filter.design import Filter
from sosmith.gen.filter.response import FilterFacts
from sosmith.gen.proof.cascade_proof import CascadeProof
from sosmith.gen.proof.linear_model import linear_models
from sosmith.gen.realizations.effective import effective_sections
from sosmith.gen.realizations.registry import Section
from sosmith.gen.word_lengths.input_stage import InputStage
from sosmith.gen.word_lengths.output_stage import output_stage
from sosmith.model.arrays import Codes, Values
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.decimator import Decimator
from sosmith.model.dataflow.structure import Stage
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port
from sosmith.model.reference.golden import exact_before_filter, exact_chain
from sosmith.model.sections.horner import HornerStep
from sosmith.model.sections.output import FirstSample, OutputStage
from sosmith.model.sections.start import PassingStage, StartStage

Array = npt.NDArray[np.float64]

CALIBRATION = "calibration"
"""The part of the budget that is the error of the calibration."""

DECIMATION = "decimation"
"""The part of the budget that is the rounding behind a decimator."""

START = "start"
"""The part of the budget that is the error of what starts a filter from its first sample."""


@dataclass(frozen=True, kw_only=True)
class Quantized:
    """A datapath and the proven bound on its error.

    Attributes
    ----------
    datapath : Datapath
        The bit-true datapath.
    filter : Filter or None
        The ideal filter; None for a calibration core.
    polynomial : Polynomial or None
        The ideal polynomial; None for a filter core.
    realization : str
        Name of the sections' realization.
    budget : dict of str to Fraction
        Parts of the error bound in output LSBs, each proven.
    input_error : Fraction
        Bound on the error of the input stage, at the filter's input, in output LSBs; exact.
    proof : CascadeProof or None
        The proof of the sections; None without a filter.
    decimation : Decimation or None
        How samples are decimated before the filter; None if all go in.
    calibration : Quantized or None
        The calibration before the decimator; None without one.
    """

    datapath: Datapath
    filter: Filter | None
    polynomial: Polynomial | None
    realization: str
    budget: dict[str, Fraction]
    input_error: Fraction
    proof: CascadeProof | None
    decimation: Decimation | None = None
    calibration: Quantized | None = None

    @property
    def bound(self) -> Fraction:
        """Proven bound on ``|output - exact|`` in output LSBs, the exact value limited to the output's range."""
        return sum(self.budget.values(), Fraction(0))

    @property
    def sections(self) -> tuple[Section, ...]:
        """The filter's sections, in the order of the cascade."""
        stages = (s for s in self.datapath.stages if not isinstance(s, HornerStep | StartStage | OutputStage))
        return tuple(cast("Section", s.section if isinstance(s, PassingStage) else s) for s in stages)

    @property
    def steady(self) -> bool:
        """Whether the filter starts from its first sample, and not from zero."""
        return any(isinstance(stage, StartStage) for stage in self.datapath.stages)

    @property
    def starts_steady(self) -> bool:
        """Whether it starts from its first sample: beside the sections, or by what fills a filter that decimates."""
        down = self.datapath.downsampler
        return self.steady or (down is not None and down.filled > 0)

    @property
    def first_sample(self) -> FirstSample | None:
        """The first sample as the last stage adds it; None if it does not."""
        return cast("OutputStage", self.datapath.stages[-1]).held

    @property
    def settling(self) -> int:
        """Samples of the filter after a start that are flagged as settling; 0 without the flag."""
        return cast("OutputStage", self.datapath.stages[-1]).settling

    @property
    def settling_of_input(self) -> int:
        """The same in samples of the input."""
        return self.settling * self.samples_of_input

    @property
    def samples_of_input(self) -> int:
        """Samples of the input for each of the filter: one without a decimator."""
        decimator = self.datapath.decimator
        return 1 if decimator is None else decimator.factor

    def unfiltered(self, codes: Codes) -> Values:
        """Compute what enters the filter, in double precision, at the samples that bring a result."""
        return exact_before_filter(codes, self.datapath, self.polynomial)

    def exact(self, codes: Codes) -> Values:
        """Compute what the datapath approximates, in double precision; `codes` are (samples, channels, inputs)."""
        sos = None if self.filter is None else self.filter.sos
        return exact_chain(codes, self.datapath, self.polynomial, sos, steady=self.starts_steady)

    @cached_property
    def filter_facts(self) -> FilterFacts | None:
        """The filter as specified and as realized, for its measures and pictures; None without one."""
        ideal = self.filter
        if ideal is None:
            return None
        return FilterFacts(
            sample_rate=ideal.sample_rate,
            ideal_sos=ideal.sos,
            quantized_sos=self.quantized_sos,
            kind=ideal.kind,
            passband_edge=ideal.passband_edge,
            stopband_edge=ideal.stopband_edge,
            passband_loss=ideal.passband_loss,
            stopband_loss=ideal.stopband_loss,
            cutoff=ideal.cutoff,
            cutoff_of_stopband=ideal.cutoff_of_stopband,
        )

    @cached_property
    def quantized_sos(self) -> Array:
        """Second-order sections that the integer coefficients realize, shape (sections, 6)."""
        return effective_sections([linear_models(section.graph) for section in self.sections])


def assembled(
    *,
    name: str,
    inputs: tuple[Port, ...],
    output: Port,
    ideal: Filter | None,
    polynomial: Polynomial | None,
    realization: str,
    gain: Fraction,
    input_stage: InputStage,
    sections: Sequence[Section],
    proof: CascadeProof | None,
) -> Quantized:
    """Combine stages into a datapath and add up its error budget; `gain` is that of the filter, 1 without one."""
    budget: dict[str, Fraction] = {}
    if any(isinstance(stage, HornerStep) for stage in input_stage.stages):
        budget[CALIBRATION if polynomial is not None else "input scaling"] = input_stage.error * gain
    if proof is not None:
        budget |= filter_budget(proof)
    first_sample = None
    if input_stage.start is not None:
        first_sample, budget[START] = input_stage.start.first_sample, input_stage.start.error
    stages = (*input_stage.stages, *beside(sections, first_sample))
    last, error = output_stage(
        stages[-1].graph.output_ranges[0] if stages else input_stage.output, output, first_sample
    )
    budget["output rounding"] = error
    return Quantized(
        datapath=Datapath(name=name, inputs=inputs, output=output, stages=(*stages, last)),
        filter=ideal,
        polynomial=polynomial,
        realization=realization,
        budget=budget,
        input_error=input_stage.error,
        proof=proof,
    )


def counted(
    quantized: Quantized, gain: Fraction, decimation: Decimation, decimator: Decimator, calibration: Quantized | None
) -> Quantized:
    """Return a proven filter with what stands before it in its budget: the rounding of a decimator, and a calibration.

    Parameters
    ----------
    quantized : Quantized
        The filter alone.
    gain : Fraction
        Worst-case peak gain of the filter.
    decimation : Decimation
        How samples are decimated.
    decimator : Decimator
        The same as integers.
    calibration : Quantized or None
        What stands before the decimator; None if that takes the input itself.
    """
    lsb, budget = quantized.datapath.output.lsb, quantized.budget
    if decimator.rounding:
        budget = {DECIMATION: gain * decimator.rounding / lsb, **budget}
    if calibration is None:
        return replace(quantized, budget=budget, decimation=decimation)
    error = calibration.bound * calibration.datapath.output.lsb / lsb
    return replace(
        quantized,
        polynomial=calibration.polynomial,
        budget={CALIBRATION: error * gain, **budget},
        input_error=error,
        decimation=decimation,
        calibration=calibration,
    )


def beside(sections: Sequence[Section], first_sample: FirstSample | None) -> Sequence[Stage]:
    """Return the sections, with the first sample passing beside them, if there is one."""
    return (
        sections
        if first_sample is None
        else [PassingStage(section=section, held=first_sample.range) for section in sections]
    )


def filter_budget(proof: CascadeProof) -> dict[str, Fraction]:
    """Return the sections' parts of the budget."""
    return {"filter coefficients": proof.coefficients.magnitude, "filter rounding": proof.rounding.magnitude}
