"""A filter's stages, built for given words and proven, and the stage behind them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

from sosmith.gen.filter.design import Filter
from sosmith.gen.proof.cascade_proof import CascadeProof, StageModel, TransferFunction, prove_cascade
from sosmith.gen.proof.linear_model import linear_models
from sosmith.gen.proof.peak_gain import Extent
from sosmith.gen.realizations.registry import REALIZATIONS, WIDE, Section, SectionFormat
from sosmith.gen.word_lengths.search import Signal, Words
from sosmith.model.dataflow.datapath import Stage
from sosmith.model.port import Port
from sosmith.model.sections.output import OutputStage

MAX_BITS = 40
"""Significant bits of a coefficient that are tried; as many fraction bits of a signal at most: no useful design lies
beyond."""


def ideal_sections(ideal: Filter) -> list[TransferFunction]:
    """Return the ideal sections as exact rationals of their double-precision coefficients."""
    sections = []
    for row in ideal.rows:
        numerator, denominator = ([Fraction(value) for value in part] for part in (row[:3], row[3:]))
        sections.append((_shortened(numerator), _shortened(denominator)))
    return sections


def _shortened(values: Sequence[Fraction]) -> tuple[Fraction, ...]:
    end = max((k for k, value in enumerate(values) if value), default=0)
    return tuple(values[: end + 1])


def values_of(signal: Signal) -> tuple[Fraction, Fraction]:
    """Return the lowest and the highest value of a signal, in output LSBs."""
    unit = Fraction(2) ** -signal.frac
    return signal.low * unit, signal.high * unit


def parts_of(ideal: Filter, realization: str) -> Sequence[Any]:
    """Return what the realization makes its stages from, one for each."""
    return REALIZATIONS[realization].parts(ideal.rows)


def wide(ideal: Filter, realization: str, bits: int) -> list[StageModel]:
    """Models of the stages with every quantizer at whole output LSBs and no ranges."""
    formats = [SectionFormat(coefficient_bits=bits)] * len(parts_of(ideal, realization))
    return [linear_models(stage.graph) for stage in stages_of(ideal, realization, formats, Signal(0, -WIDE, WIDE))]


def cascade(
    ideal: Filter, realization: str, words: Sequence[Words], signal: Signal
) -> tuple[list[Section], CascadeProof]:
    """Build the stages, prove their ranges, and build them again with these."""
    formats = [
        SectionFormat(coefficient_bits=w.coefficient_bits, coefficients=w.coefficients, fracs=w.fracs) for w in words
    ]
    stages = stages_of(ideal, realization, formats, Signal(signal.frac, -WIDE, WIDE))
    proof = prove_cascade([linear_models(s.graph) for s in stages], ideal_sections(ideal), *values_of(signal))
    for k, (stage, extents) in enumerate(zip(stages, proof.nodes, strict=True)):
        nodes = stage.graph.nodes
        ranges = {nodes[i].name: _codes(extent, nodes[i].frac) for i, extent in extents.items()}
        formats[k] = replace(formats[k], ranges=ranges)
    return stages_of(ideal, realization, formats, signal), proof


def stages_of(ideal: Filter, realization: str, formats: Sequence[SectionFormat], signal: Signal) -> list[Section]:
    """Build the stages one after the other, each for what the one before hands on."""
    build = REALIZATIONS[realization].build
    first, beside = signal, list[Signal]()
    stages: list[Section] = []
    for k, (part, form) in enumerate(zip(parts_of(ideal, realization), formats, strict=True)):
        entry = replace(form, x_frac=first.frac, x_low=first.low, x_high=first.high, beside=tuple(beside))
        stages.append(build(part, entry, f"section{k}"))
        first, *beside = formats_of(stages[-1])
    return stages


def _codes(extent: Extent, frac: int) -> tuple[int, int]:
    """Range of codes that holds all values of an extent."""
    unit = Fraction(2) ** frac
    return math.floor(extent.low * unit), math.ceil(extent.high * unit)


def formats_of(stage: Stage) -> list[Signal]:
    """Return the formats of all outputs of a stage."""
    nodes = stage.graph.nodes
    return [Signal(nodes[i].frac, nodes[i].low, nodes[i].high) for i in stage.graph.outputs]


def format_of(stage: Stage) -> Signal:
    """Format of the only output."""
    (form,) = formats_of(stage)
    return form


def output_stage(signal: Signal, output: Port) -> tuple[OutputStage, Fraction]:
    """Make the last stage and tell its error: half an LSB where anything is rounded, and the offset's own rounding."""
    frac = max(signal.frac, 0)
    exact = -output.zero / output.lsb * 2**frac
    offset = round(exact)
    rounding = Fraction(1, 2) if signal.frac > 0 else Fraction(0)
    stage = OutputStage(
        offset=offset,
        offset_frac=frac,
        x_frac=signal.frac,
        x_low=signal.low,
        x_high=signal.high,
        low=output.lowest,
        high=output.highest,
    )
    return stage, rounding + abs(exact - offset) / 2**frac
