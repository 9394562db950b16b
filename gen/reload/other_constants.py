"""A design with the constants of another filter or polynomial, and unchanged signal formats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import cast

from sosmith.gen.filter.design import Filter
from sosmith.gen.proof.cascade_proof import quantized_response
from sosmith.gen.proof.linear_model import linear_models
from sosmith.gen.proof.polynomial_error import horner_error, rounded
from sosmith.gen.realizations.kept_formats import Choice
from sosmith.gen.realizations.registry import REALIZATIONS, Section, realization_of
from sosmith.gen.realizations.section_format import SectionFormat, unknown_range
from sosmith.gen.reload.first_samples import Limits, first_samples
from sosmith.gen.word_lengths.cascade import cascade, chosen_formats, parts_of, stages_of
from sosmith.gen.word_lengths.input_stage import InputStage, normalised, starting_like
from sosmith.gen.word_lengths.quantize import gain_at_zero, gain_of
from sosmith.gen.word_lengths.quantized import Quantized, assembled, counted
from sosmith.gen.word_lengths.search import Search
from sosmith.gen.word_lengths.settling import with_settling
from sosmith.model.dataflow.graph import Op
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial
from sosmith.model.sections.horner import HornerPolynomial, HornerStep, Variable

_DOUBLE = 53
"""Significant bits of a number in double precision."""
_SPELT = 6
"""Most coefficients of a section that a message names one by one."""


def with_constants(
    design: Quantized, ideal: Filter | None, polynomial: Polynomial | None, *, finer: int = 0, room: int = 0
) -> Quantized:
    """Return the design for another filter or another polynomial, with the same fraction bits of all signals.

    The bound is proven again and may exceed the limit in the specification.

    Parameters
    ----------
    design : Quantized
        The design.
    ideal : Filter or None
        The other filter; None to keep the present one. Sections are matched in order of the distance of their poles
        from the unit circle.
    polynomial : Polynomial or None
        The other polynomial; None to keep the present one.
    finer : int
        Additional fraction bits, beyond those of the design, to which the coefficients of another filter are rounded.
    room : int
        Additional fraction bits, at least `finer`, with which all coefficients are stored. Sets with the same room have
        the same formats, so that states carry over from one to another.

    Raises
    ------
    ShortfallError
        If the filter or polynomial does not have this structure, or is unstable with these fraction bits.
    """
    before = _input_stage(design, polynomial)
    filled = ideal or design.filter
    sections: Sequence[Section] = ()
    proof = None
    if filled is not None:
        if ideal is not None:
            filled = _ranked(ideal, cast("Filter", design.filter), design.realization)
        formats = _lifted(chosen_formats(design.sections), finer)
        if ideal is not None and filled != design.filter:
            formats = _with_coefficients_of(filled, formats, design.realization)
            formats = _closer(filled, formats, design, before)
        formats = _lifted(formats, room - finer)
        if design.steady:
            before = starting_like(before, gain_at_zero(filled), design.first_sample)
        sections, proof = cascade(filled, design.realization, formats, before.output, steady=design.steady)
        if design.steady and not design.datapath.restarts:  # which would take another first sample
            before = _with_any_first_sample(before, first_samples(design), sections, filled)
    datapath = design.datapath
    gain = Fraction(1) if filled is None else gain_of(filled)
    other = assembled(
        name=datapath.name,
        inputs=datapath.entry,
        output=datapath.output,
        ideal=filled,
        polynomial=polynomial or design.polynomial,
        realization=design.realization,
        gain=gain,
        input_stage=before,
        sections=sections,
        proof=proof,
    )
    if datapath.decimator is not None and design.decimation is not None:
        edge = design.decimation.edge if ideal is None or ideal.cutoff is None else Fraction(ideal.cutoff[0])
        decimation = replace(design.decimation, edge=edge)
        other = counted(other, gain, decimation, datapath.decimator, design.calibration)
    flagged = with_settling(other.datapath, design.settling)
    return replace(other, datapath=replace(datapath, stages=flagged.stages))


def _with_any_first_sample(
    before: InputStage, first_range: Limits, sections: Sequence[Section], ideal: Filter
) -> InputStage:
    """Return an input stage with the error of the start for first samples in `first_range`.

    With the difference D of the quantized filter and the ideal one, the coefficients' error is that of ``D (x - x0)``.
    It is proven for x0 in the range of x; for each unit that x0 lies outside it may be larger by ``|D(1)|``.
    """
    assert before.start is not None
    start = before.start
    _, span = before.output.limits  # of the samples less a first one: as wide as the range of the samples
    wider = first_range[1] - first_range[0] - span
    realized = quantized_response([linear_models(section.graph) for section in sections])
    off = realized.at_zero_frequency - gain_at_zero(ideal)
    first = start.first_sample
    gain = Fraction(0) if first is None else first.gain * Fraction(2) ** -first.gain_frac
    error = abs(gain - gain_at_zero(ideal)) * max(-first_range[0], first_range[1]) + abs(off) * max(wider, Fraction(0))
    return replace(before, start=replace(start, error=error))


def _input_stage(design: Quantized, polynomial: Polynomial | None) -> InputStage:
    """Make the input stage, for another polynomial if it is not None."""
    datapath = design.datapath
    stages = tuple(stage for stage in datapath.stages if isinstance(stage, HornerStep))
    if polynomial is None or design.polynomial is None:
        behind = datapath.stages[len(stages)].graph
        # A calibration before a decimator counts for itself.
        error = design.input_error if design.calibration is None else Fraction(0)
        return InputStage(stages=stages, output=behind.input_ranges[0], error=error)
    room = [len(row) for row in normalised(design.polynomial, datapath.inputs, datapath.output)]
    exact = normalised(polynomial, datapath.inputs, datapath.output)
    counts = [len(row) for row in exact]
    if len(counts) > len(room) or any(count > most for count, most in zip(counts, room, strict=False)):
        raise ShortfallError(f"the calibration must have at most {room} coefficients in its rows, not {counts}")
    zero = Fraction(0)
    filled = tuple(
        (*row, *[zero] * (most - len(row))) for row, most in zip([*exact, *[()] * len(room)], room, strict=False)
    )
    frac = stages[-1].graph.output_ranges[0].frac
    variables = tuple(Variable(name=p.name, bits=p.bits, signed=p.signed) for p in datapath.inputs)
    finer = _finest(stages) - frac
    horner = HornerPolynomial(
        coefficients=rounded(filled, frac, variables), frac=frac, variables=variables, finer=finer
    )
    (output,) = horner.stages[-1].graph.output_ranges
    return InputStage(stages=horner.stages, output=output, error=horner_error(filled, horner))


def _finest(stages: Sequence[HornerStep]) -> int:
    """Fraction bits of the row that has the most."""
    named = (node for stage in stages for node in stage.graph.nodes if node.op is Op.FLOOR)
    return max((node.frac for node in named), default=stages[-1].graph.output_ranges[0].frac)


def _ranked(ideal: Filter, like: Filter, realization: str) -> Filter:
    """Return the filter with its sections in the order of `like`, matched by their pole radii."""
    if not REALIZATIONS[realization].cascade or len(ideal.rows) != len(like.rows):
        return ideal
    ranks = sorted(range(len(like.rows)), key=lambda k: _nearness(like.rows[k]))
    rows = dict(zip(ranks, sorted(ideal.rows, key=_nearness), strict=True))
    return replace(ideal, rows=tuple(rows[k] for k in range(len(rows))))


def _nearness(row: Sequence[float]) -> tuple[bool, float]:
    """Sort key: sections of first order first, then by the radius of their poles."""
    return row[5] != 0, row[5]


def _lifted(formats: Sequence[SectionFormat], bits: int) -> list[SectionFormat]:
    """Write all coefficients with `bits` more fraction bits and the same values."""
    return [
        replace(f, coefficients={name: (code << bits, frac + bits) for name, (code, frac) in f.coefficients.items()})
        for f in formats
    ]


def _closer(ideal: Filter, formats: list[SectionFormat], design: Quantized, before: InputStage) -> list[SectionFormat]:
    """Return `formats` with coefficients of the same formats whose error is smaller, where the design was searched."""
    if not realization_of(design.realization).cascade:
        return formats
    try:
        search = Search(ideal.rows, design.realization, [before], gain_of(ideal), steady=design.steady)
        closer = search.with_closer_coefficients(Choice(0, tuple(formats))).formats
    except ShortfallError:
        return formats
    fracs = [{name: frac for name, (_, frac) in form.coefficients.items()} for form in formats]
    return [
        replace(
            form,
            coefficients={
                name: (code << kept[name] - frac, kept[name]) for name, (code, frac) in form.coefficients.items()
            },
        )
        for form, kept in zip(closer, fracs, strict=True)
    ]


def _spelt(sections: Sequence[Sequence[str]]) -> str:
    """Return the names of coefficients, section by section; of an FIR filter with many, the ends and how many."""
    short = (
        f"{names[0]}, {names[1]}, ..., {names[-1]} ({len(names)} in all)" if len(names) > _SPELT else ", ".join(names)
        for names in sections
    )
    return " and ".join(short)


def _with_coefficients_of(ideal: Filter, formats: Sequence[SectionFormat], realization: str) -> list[SectionFormat]:
    """Return `formats` with the coefficients of another filter, rounded to the same fraction bits."""
    nearest = [SectionFormat(coefficient_bits=_DOUBLE)] * len(parts_of(ideal, realization))
    exact = stages_of(ideal, realization, nearest, unknown_range(0))
    names, wanted = ([list(f.coefficients) for f in formats], [list(stage.coefficients) for stage in exact])
    if names != wanted:
        raise ShortfallError(
            f"the filter's sections must have the coefficients {_spelt(names)}, not {_spelt(wanted)}: "
            "what is loaded are values, and the core stays as it is"
        )
    result = []
    for old, stage in zip(formats, exact, strict=True):
        coefficients = {}
        for name, (integer, frac) in stage.coefficients.items():
            kept = old.coefficients[name][1]
            coefficients[name] = (round(integer * Fraction(2) ** (kept - frac)), kept)
            if not coefficients[name][0]:
                raise ShortfallError(f"{name} of {stage.name} must not vanish with {kept} fraction bits")
        result.append(replace(old, coefficients=coefficients))
    return result
