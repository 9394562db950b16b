"""A design with the constants of another filter or polynomial, all signals as they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import cast

from sosmith.gen.filter.design import Filter
from sosmith.gen.proof.linear_model import linear_models
from sosmith.gen.realizations.registry import REALIZATIONS, WIDE, Section, SectionFormat
from sosmith.gen.word_lengths.cascade import cascade, format_of, formats_of, parts_of, stages_of
from sosmith.gen.word_lengths.input_stage import EntryStages, horner_error, normalised
from sosmith.gen.word_lengths.quantize import Plan, Quantized, assembled, gain_of
from sosmith.gen.word_lengths.search import Signal, Words
from sosmith.model.calibration.polynomial import Polynomial
from sosmith.model.errors import ShortfallError
from sosmith.model.sections.horner import HornerPolynomial, HornerStep, Variable

_DOUBLE = 53
"""Significant bits of a number in double precision."""


def with_constants(
    made: Quantized, ideal: Filter | None, polynomial: Polynomial | None, *, finer: int = 0, room: int = 0
) -> Quantized:
    """Return the design for another filter or another polynomial, with no bit more or less of any signal.

    The bound is proven anew and may exceed what the specification allows.

    Parameters
    ----------
    made : Quantized
        The design.
    ideal : Filter or None
        The other filter; None for the one it has. Sections take the places of those with the same rank by the
        distance of their poles from the unit circle.
    polynomial : Polynomial or None
        The other polynomial; None for the one it has.
    finer : int
        Fraction bits to which the coefficients of another filter are rounded beyond those of the design.
    room : int
        Fraction bits, at least `finer`, that all coefficients are written with beyond those of the design: sets that
        are made with the same room have the same formats, so that states carry over from one to another.

    Raises
    ------
    ShortfallError
        If the filter or polynomial does not have this structure, or is unstable with these fraction bits.
    """
    entry = _entry_with(made, polynomial)
    filled = ideal or made.filter
    sections: Sequence[Section] = ()
    proof = None
    if filled is not None:
        if ideal is not None:
            filled = _ranked(ideal, cast("Filter", made.filter), made.realization)
        words = _lifted(_words_of(made), finer)
        if ideal is not None:
            words = _words_with(words, made, filled)
        words = _lifted(words, room - finer)
        sections, proof = cascade(filled, made.realization, words, entry.signal)
    datapath = made.datapath
    found = assembled(
        Plan(
            name=datapath.name,
            inputs=datapath.inputs,
            output=datapath.output,
            max_error=made.bound * datapath.output.lsb,
            ideal=filled,
            polynomial=polynomial or made.polynomial,
            realization=made.realization,
            gain=Fraction(1) if filled is None else gain_of(filled),
            share=Fraction(0),
            entries=(entry,),
            search=None,
            start=None,
        ),
        entry,
        sections,
        proof,
    )
    return replace(found, datapath=replace(found.datapath, calibrated=datapath.calibrated, wear=datapath.wear))


def _entry_with(made: Quantized, polynomial: Polynomial | None) -> EntryStages:
    """Make what stands before the sections, for another polynomial if it is not None."""
    datapath = made.datapath
    stages = tuple(stage for stage in datapath.stages if isinstance(stage, HornerStep))
    if polynomial is None or made.polynomial is None:
        node = datapath.stages[len(stages)].graph.nodes[datapath.stages[len(stages)].graph.inputs[0]]
        return EntryStages(stages=stages, signal=Signal(node.frac, node.low, node.high), error=made.entry_error)
    room = [len(row) for row in normalised(made.polynomial, datapath.inputs, datapath.output)]
    exact = normalised(polynomial, datapath.inputs, datapath.output)
    counts = [len(row) for row in exact]
    if len(counts) > len(room) or any(count > most for count, most in zip(counts, room, strict=False)):
        raise ShortfallError(f"the calibration must have at most {room} coefficients in its rows, not {counts}")
    zero = Fraction(0)
    filled = tuple(
        (*row, *[zero] * (most - len(row))) for row, most in zip([*exact, *[()] * len(room)], room, strict=False)
    )
    frac = format_of(stages[-1]).frac
    horner = HornerPolynomial(
        coefficients=tuple(tuple(round(c * 2**frac) for c in row) for row in filled),
        frac=frac,
        variables=tuple(Variable(name=p.name, bits=p.bits, signed=p.signed) for p in datapath.inputs),
    )
    return EntryStages(stages=horner.stages, signal=format_of(horner.stages[-1]), error=horner_error(filled, horner))


def _ranked(ideal: Filter, like: Filter, realization: str) -> Filter:
    """Return the filter with its sections in the order of `like`: each has the same rank by its pole radius."""
    if not REALIZATIONS[realization].cascade or len(ideal.rows) != len(like.rows):
        return ideal
    ranks = sorted(range(len(like.rows)), key=lambda k: _nearness(like.rows[k]))
    rows = dict(zip(ranks, sorted(ideal.rows, key=_nearness), strict=True))
    return replace(ideal, rows=tuple(rows[k] for k in range(len(rows))))


def _nearness(row: Sequence[float]) -> tuple[bool, float]:
    """Key that sorts sections of first order first, then by the radius of their poles."""
    return row[5] != 0, row[5]


def _words_of(made: Quantized) -> list[Words]:
    """Coefficients of all sections, and fraction bits that their quantizers keep."""
    words = []
    for section in made.sections:
        models = linear_models(section.graph)
        kept = {s.name: s.kept for model in models for s in model.sources if s.kept is not None}
        words.append(Words(section.coefficients, {"v": formats_of(section)[0].frac} | kept))
    return words


def _lifted(words: Sequence[Words], bits: int) -> list[Words]:
    """Write all coefficients with `bits` more fraction bits, of the same value."""
    return [
        replace(w, coefficients={name: (code << bits, frac + bits) for name, (code, frac) in w.coefficients.items()})
        for w in words
    ]


def _words_with(words: Sequence[Words], made: Quantized, ideal: Filter) -> list[Words]:
    """Return `words` with the coefficients of another filter, rounded to the fraction bits of these."""
    exact = stages_of(
        ideal,
        made.realization,
        [SectionFormat(coefficient_bits=_DOUBLE)] * len(parts_of(ideal, made.realization)),
        Signal(0, -WIDE, WIDE),
    )
    names, wanted = ([list(w.coefficients) for w in words], [list(stage.coefficients) for stage in exact])
    if names != wanted:
        raise ShortfallError(f"the filter's sections must have the coefficients {names}, not {wanted}")
    result = []
    for old, stage in zip(words, exact, strict=True):
        coefficients = {}
        for name, (integer, frac) in stage.coefficients.items():
            kept = old.coefficients[name][1]
            coefficients[name] = (round(integer * Fraction(2) ** (kept - frac)), kept)
            if not coefficients[name][0]:
                raise ShortfallError(f"{name} of {stage.name} must not vanish with {kept} fraction bits")
        result.append(replace(old, coefficients=coefficients))
    return result
