"""A filter's stages, built in given formats and proven."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

from sosmith.gen.filter.design import Filter
from sosmith.gen.proof.cascade_proof import CascadeProof, StageModel, prove_cascade
from sosmith.gen.proof.linear_model import linear_models
from sosmith.gen.proof.peak_gain import Extent
from sosmith.gen.realizations.registry import Section, realization_of
from sosmith.gen.realizations.section_format import SectionFormat, unknown_range
from sosmith.model.dataflow.graph import Range
from sosmith.model.sections.direct_form import DirectForm1


def parts_of(ideal: Filter, realization: str) -> Sequence[Any]:
    """Return the parts that the realization makes its stages from, one for each stage."""
    return realization_of(realization).parts(ideal.rows)


def unquantized(ideal: Filter, realization: str, bits: int) -> list[StageModel]:
    """Models of the stages with coefficients of `bits` significant bits and quantizers that keep whole output LSBs."""
    formats = [SectionFormat(coefficient_bits=bits)] * len(parts_of(ideal, realization))
    return [linear_models(stage.graph) for stage in stages_of(ideal, realization, formats, unknown_range(0))]


def cascade(
    ideal: Filter, realization: str, formats: Sequence[SectionFormat], x: Range, *, steady: bool = False
) -> tuple[list[Section], CascadeProof]:
    """Build the stages for an input in `x`, prove their ranges, and build them again with these ranges.

    `steady` is as for `sosmith.gen.proof.cascade_proof.prove_cascade`.
    """
    stages = stages_of(ideal, realization, formats, unknown_range(x.frac))
    proof = prove_cascade([linear_models(s.graph) for s in stages], ideal.exact, *x.limits, steady=steady)
    proven = list(formats)
    for k, (stage, extents) in enumerate(zip(stages, proof.nodes, strict=True)):
        nodes = stage.graph.nodes
        ranges = {nodes[i].name: _codes(extent, nodes[i].frac) for i, extent in extents.items()}
        proven[k] = replace(formats[k], ranges=ranges)
    return stages_of(ideal, realization, proven, x), proof


def stages_of(ideal: Filter, realization: str, formats: Sequence[SectionFormat], x: Range) -> list[Section]:
    """Build the stages in order, each for the output range of the previous one."""
    build = realization_of(realization).build
    first, beside = x, list[Range]()
    stages: list[Section] = []
    for k, (part, form) in enumerate(zip(parts_of(ideal, realization), formats, strict=True)):
        stages.append(build(part, replace(form, x=first, beside=tuple(beside)), f"section{k}"))
        first, *beside = stages[-1].graph.output_ranges
    return stages


def chosen_formats(sections: Sequence[Section]) -> list[SectionFormat]:
    """Return the coefficients of all sections and the fraction bits that their quantizers keep."""
    formats = []
    for section in sections:
        if isinstance(section, DirectForm1):
            fracs = section.fracs
        else:
            models = linear_models(section.graph)
            kept = {s.name: s.kept for model in models for s in model.sources if s.kept is not None}
            fracs = {"v": section.graph.output_ranges[0].frac} | kept
        formats.append(SectionFormat(coefficients=section.coefficients, fracs=fracs))
    return formats


def _codes(extent: Extent, frac: int) -> tuple[int, int]:
    """Range of codes that covers all values of an extent."""
    unit = Fraction(2) ** frac
    return math.floor(extent.low * unit), math.ceil(extent.high * unit)
