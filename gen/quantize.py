"""From a specification to a frozen datapath: word lengths chosen by estimates, then proven.

All amounts inside are in output LSBs. What `max_error` leaves beside the half LSB of the output rounding is
divided equally between calibration, filter coefficients and filter rounding to begin with; then words are trimmed to
the smallest estimated area, on whichever part that costs error (`sosmith.gen.word_lengths`). The parts of the bound
are proven for what came out, and so are the ranges of all nodes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from sosmith.gen.cost import area_of, cost_of, cost_of_graphs
from sosmith.gen.design import Filter
from sosmith.gen.effective import effective_sections
from sosmith.gen.linear_model import linear_model, linear_models
from sosmith.gen.ordering import best_order
from sosmith.gen.peak_gain import Extent
from sosmith.gen.proof import (
    CascadeProof,
    StageModel,
    TransferFunction,
    coefficient_extent,
    ideal_gain,
    prove_cascade,
    rounding_gains,
)
from sosmith.gen.realizations import BEST_KEPT, REALIZATIONS, WIDE, Section, SectionFormat
from sosmith.gen.word_lengths import FEWEST_BITS, Choice, Entry, Search, Signal, Words
from sosmith.model.datapath import Datapath, Stage
from sosmith.model.errors import ShortfallError
from sosmith.model.horner import HornerPolynomial, HornerStep, Variable
from sosmith.model.output import OutputStage
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port

Array = npt.NDArray[np.float64]

_MOST_BITS = 40
"""Significant bits of a coefficient that are tried; as many fraction bits of a signal at most: no useful design lies
beyond."""

_BITS_TO_ORDER = 24
"""Significant bits of the coefficients with which orders of the sections are compared."""

_ATTEMPTS = 4
"""Times that words are chosen anew before they are chosen another way."""

_DOUBLE = 53
"""Significant bits of a number in double precision."""

_COARSER = 4
"""Fraction bits that the calibration may have less than with an equal share of the budget."""


@dataclass(frozen=True, kw_only=True)
class Quantized:
    """A datapath and the proven bound on its error.

    Attributes
    ----------
    datapath : Datapath
        What is computed, bit for bit.
    filter : Filter or None
        The ideal filter; None for a calibration core.
    polynomial : Polynomial or None
        The ideal polynomial; None for a filter core.
    realization : str
        Name of the sections' realization.
    budget : dict of str to Fraction
        Parts of the error bound in output LSBs, each proven.
    entry_error : Fraction
        Bound on the error of what comes before the filter, at the filter's input, in output LSBs; exact.
    proof : CascadeProof or None
        The proof of the sections; None without a filter.
    """

    datapath: Datapath
    filter: Filter | None
    polynomial: Polynomial | None
    realization: str
    budget: dict[str, Fraction]
    entry_error: Fraction
    proof: CascadeProof | None

    @property
    def bound(self) -> Fraction:
        """Proven bound on ``|output - exact|`` in output LSBs, the exact value limited to the output's range."""
        return sum(self.budget.values(), Fraction(0))

    @property
    def sections(self) -> tuple[Section, ...]:
        """The filter's sections, in the order of the cascade."""
        return tuple(cast("Section", s) for s in self.datapath.stages if not isinstance(s, HornerStep | OutputStage))

    @cached_property
    def quantized_sos(self) -> Array:
        """The transfer functions that the integer coefficients make, shape (sections, 6)."""
        return effective_sections([linear_models(section.graph) for section in self.sections])


@dataclass(frozen=True, kw_only=True)
class _Entry:
    """What may stand before the sections: its stages, the signal that they give, and its error in output LSBs."""

    stages: tuple[Stage, ...]
    signal: Signal
    error: Fraction


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Words chosen in double precision, not proven yet.

    Attributes
    ----------
    name, inputs, output, max_error, ideal, polynomial, realization
        As for `plan`, the filter's sections in the order of the cascade.
    gain : Fraction
        Worst-case peak gain of the filter, 1 without one.
    share : Fraction
        Error of each part of the budget but the output rounding, in output LSBs, where all get the same.
    entries : tuple of _Entry
        What may stand before the sections, each a little coarser than the one before.
    search : Search or None
        The search that words come from; None without a filter.
    start : Choice or None
        Words that keep to `share`; None where double precision found none.
    made : Quantized or None
        The proven design itself, of a realization that there are no estimates for.
    """

    name: str
    inputs: tuple[Port, ...]
    output: Port
    max_error: Fraction
    ideal: Filter | None
    polynomial: Polynomial | None
    realization: str
    gain: Fraction
    share: Fraction
    entries: tuple[_Entry, ...]
    search: Search | None
    start: Choice | None
    made: Quantized | None = None

    @property
    def allowed(self) -> Fraction:
        """Error of everything but the output rounding, in output LSBs."""
        return self.max_error / self.output.lsb - Fraction(1, 2)

    @cached_property
    def area(self) -> float:
        """Estimated area, infinite where there is no estimate."""
        if self.made is not None:
            return cost_of(self.made.datapath).area
        if self.search is None or self.start is None:
            return math.inf
        last, _ = _output_stage(self.search.output(self.start), self.output)
        return self.search.area(self.start) + cost_of_graphs([last.graph]).area

    def trimmed(self) -> Plan:
        """Return the same with words from which nothing more can be saved."""
        if self.search is None or self.start is None:
            return self
        return replace(self, start=self.search.trimmed(self.start, float(self.allowed)))


def plan(
    *,
    name: str,
    inputs: tuple[Port, ...],
    output: Port,
    max_error: Fraction,
    ideal: Filter | None,
    polynomial: Polynomial | None,
    realization: str,
) -> Plan:
    """Choose formats and integer coefficients that keep to equal shares of the error allowed.

    Parameters
    ----------
    name : str
        Name of the core.
    inputs, output : Port
        Its ports; two inputs with a polynomial, one without.
    max_error : Fraction
        Error allowed, in the unit of `output`; more than half an LSB.
    ideal : Filter or None
        Filter; None for a calibration core.
    polynomial : Polynomial or None
        Calibration polynomial in physical units; None for a filter core.
    realization : str
        A key of `REALIZATIONS`.

    Raises
    ------
    ShortfallError
        If the calibration cannot keep to its share of `max_error`, a section cannot be built, or the filter cannot be
        realized so.
    """
    scaled = polynomial is not None or _needs_scaling(inputs[0], output)
    parts = scaled + 2 * (ideal is not None)
    share = (max_error / output.lsb - Fraction(1, 2)) / max(parts, 1)
    gain = Fraction(1) if ideal is None else _gain(ideal)
    if scaled:
        normalised = _normalised(polynomial or _IDENTITY, inputs, output)
        entries = _entries(normalised, inputs, share / gain)
    else:
        exponent = _exponent_of_two(inputs[0].lsb / output.lsb)
        assert exponent is not None
        signal = Signal(-exponent, inputs[0].lowest, inputs[0].highest)
        entries = (_Entry(stages=(), signal=signal, error=Fraction(0)),)
    search, start = None, None
    if ideal is not None and REALIZATIONS[realization].cascade:
        ideal = _ordered(ideal, realization)
        search = Search(
            ideal.rows,
            realization,
            [Entry(e.signal, float(e.error * gain), sum(area_of(stage.graph) for stage in e.stages)) for e in entries],
        )
        start = search.start(float(share), _MOST_BITS)
    planned = Plan(
        name=name,
        inputs=inputs,
        output=output,
        max_error=max_error,
        ideal=ideal,
        polynomial=polynomial,
        realization=realization,
        gain=gain,
        share=share,
        entries=entries,
        search=search,
        start=start,
    )
    if ideal is None or search is not None:
        return planned
    return replace(planned, made=_equally_shared(planned, ideal))


def quantize(
    *,
    name: str,
    inputs: tuple[Port, ...],
    output: Port,
    max_error: Fraction,
    ideal: Filter | None,
    polynomial: Polynomial | None,
    realization: str,
) -> Quantized:
    """Choose formats and integer coefficients, and prove their error: `prove` of a trimmed `plan`."""
    return prove(
        plan(
            name=name,
            inputs=inputs,
            output=output,
            max_error=max_error,
            ideal=ideal,
            polynomial=polynomial,
            realization=realization,
        ).trimmed()
    )


def prove(planned: Plan) -> Quantized:
    """Fix formats and integer coefficients, and prove their error.

    Where the proof finds the planned words too short, they are chosen again with less allowed; if that does not end
    well, with the same share for every part of the budget and exact figures instead of estimates.

    Raises
    ------
    ShortfallError
        If no formats within the limits keep to the error allowed.
    """
    if planned.made is not None:
        return planned.made
    ideal, search, start = planned.ideal, planned.search, planned.start
    if ideal is None:
        return _assembled(planned, planned.entries[0], (), None)
    allowed = planned.allowed
    if search is not None and start is not None:
        choice = start
        for _ in range(_ATTEMPTS):
            entry = planned.entries[choice.entry]
            try:
                made = _assembled(planned, entry, *_cascade(ideal, planned.realization, choice.words, entry.signal))
            except ShortfallError:
                break
            excess = made.bound * planned.output.lsb - planned.max_error
            if excess <= 0:
                return made
            allowed -= max(2 * excess / planned.output.lsb, allowed / 64)
            choice = search.trimmed(search.start(float(planned.share), _MOST_BITS) or start, float(allowed))
    return _equally_shared(planned, ideal)


def _equally_shared(planned: Plan, ideal: Filter) -> Quantized:
    """Give every part of the budget the same share, by exact figures."""
    entry, realization, share = planned.entries[0], planned.realization, planned.share
    _parts(ideal, realization)  # refused here, not for want of bits, if it cannot be realized so
    bits = _coefficient_bits(ideal, realization, entry.signal, share)
    fracs = _fraction_bits(ideal, realization, bits, share)
    while True:
        words = _rounded(ideal, realization, bits, fracs)
        sections, proof = _cascade(ideal, realization, words, entry.signal)
        if proof.rounding.magnitude <= share:
            return _assembled(planned, entry, sections, proof)
        # A quantizer's error is not centred.
        finer = [{name: frac + 1 for name, frac in sources.items()} for sources in fracs]
        fracs = _within_limits(finer, ideal, realization, share)


def _assembled(planned: Plan, entry: _Entry, sections: Sequence[Section], proof: CascadeProof | None) -> Quantized:
    budget: dict[str, Fraction] = {}
    if entry.stages:
        budget["calibration" if planned.polynomial is not None else "input scaling"] = entry.error * planned.gain
    if proof is not None:
        budget |= _filter_budget(proof)
    stages = (*entry.stages, *sections)
    stage, error = _output_stage(_format_of(stages[-1]) if stages else entry.signal, planned.output)
    budget["output rounding"] = error
    return Quantized(
        datapath=Datapath(name=planned.name, inputs=planned.inputs, output=planned.output, stages=(*stages, stage)),
        filter=planned.ideal,
        polynomial=planned.polynomial,
        realization=planned.realization,
        budget=budget,
        entry_error=entry.error,
        proof=proof,
    )


def with_realization(quantized: Quantized, realization: str) -> Quantized:
    """Return the design in another of the realizations of `ERROR_FEEDBACK`, with the same words.

    The bound is proven anew and may exceed what the specification allows.
    """
    ideal = quantized.filter
    assert ideal is not None
    stages = quantized.datapath.stages
    first = next(index for index, stage in enumerate(stages) if stage in quantized.sections)
    entry = quantized.sections[0].graph
    node = entry.nodes[entry.inputs[0]]
    words = []
    for section in quantized.sections:
        kept = {source.name: source.kept for source in linear_model(section.graph).sources if source.kept is not None}
        words.append(Words(section.coefficients, {"v": _format_of(section).frac} | kept))
    sections, proof = _cascade(ideal, realization, words, Signal(node.frac, node.low, node.high))
    stage, error = _output_stage(_format_of(sections[-1]), quantized.datapath.output)
    return replace(
        quantized,
        datapath=replace(quantized.datapath, stages=(*stages[:first], *sections, stage)),
        realization=realization,
        budget=quantized.budget | _filter_budget(proof) | {"output rounding": error},
        proof=proof,
    )


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
        sections, proof = _cascade(filled, made.realization, words, entry.signal)
    datapath = made.datapath
    found = _assembled(
        Plan(
            name=datapath.name,
            inputs=datapath.inputs,
            output=datapath.output,
            max_error=made.bound * datapath.output.lsb,
            ideal=filled,
            polynomial=polynomial or made.polynomial,
            realization=made.realization,
            gain=Fraction(1) if filled is None else _gain(filled),
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


def _entry_with(made: Quantized, polynomial: Polynomial | None) -> _Entry:
    """Make what stands before the sections, for another polynomial if it is not None."""
    datapath = made.datapath
    stages = tuple(stage for stage in datapath.stages if isinstance(stage, HornerStep))
    if polynomial is None or made.polynomial is None:
        node = datapath.stages[len(stages)].graph.nodes[datapath.stages[len(stages)].graph.inputs[0]]
        return _Entry(stages=stages, signal=Signal(node.frac, node.low, node.high), error=made.entry_error)
    room = [len(row) for row in _normalised(made.polynomial, datapath.inputs, datapath.output)]
    exact = _normalised(polynomial, datapath.inputs, datapath.output)
    counts = [len(row) for row in exact]
    if len(counts) > len(room) or any(count > most for count, most in zip(counts, room, strict=False)):
        raise ShortfallError(f"the calibration must have at most {room} coefficients in its rows, not {counts}")
    zero = Fraction(0)
    filled = tuple(
        (*row, *[zero] * (most - len(row))) for row, most in zip([*exact, *[()] * len(room)], room, strict=False)
    )
    frac = _format_of(stages[-1]).frac
    horner = HornerPolynomial(
        coefficients=tuple(tuple(round(c * 2**frac) for c in row) for row in filled),
        frac=frac,
        variables=tuple(Variable(name=p.name, bits=p.bits, signed=p.signed) for p in datapath.inputs),
    )
    return _Entry(stages=horner.stages, signal=_format_of(horner.stages[-1]), error=_horner_error(filled, horner))


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
        words.append(Words(section.coefficients, {"v": _formats_of(section)[0].frac} | kept))
    return words


def _lifted(words: Sequence[Words], bits: int) -> list[Words]:
    """Write all coefficients with `bits` more fraction bits, of the same value."""
    return [
        replace(w, coefficients={name: (code << bits, frac + bits) for name, (code, frac) in w.coefficients.items()})
        for w in words
    ]


def _words_with(words: Sequence[Words], made: Quantized, ideal: Filter) -> list[Words]:
    """Return `words` with the coefficients of another filter, rounded to the fraction bits of these."""
    exact = _stages(
        ideal,
        made.realization,
        [SectionFormat(coefficient_bits=_DOUBLE)] * len(_parts(ideal, made.realization)),
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


def _gain(ideal: Filter) -> Fraction:
    try:
        return ideal_gain(ideal_sections(ideal))
    except ShortfallError as error:
        raise ShortfallError(f"{error}{_remedy_of_poles(ideal)}") from None


def _remedy_of_poles(ideal: Filter) -> str:
    """Name what moves a filter's poles away from the unit circle, if that is known."""
    if ideal.cutoff is None:
        return ""
    if ideal.decimation > 1:
        return f", decimate by {ideal.decimation} first"
    if len(ideal.cutoff) > 1:
        return ", widen the band"
    return ", move the cutoff further from 0 and from half the sample rate"


def _ordered(ideal: Filter, realization: str) -> Filter:
    """Return the filter with its sections in the order that rounds best, if that is worth a change."""
    try:
        models = [model for (model,) in _wide(ideal, realization, _BITS_TO_ORDER)]
    except ShortfallError:
        return ideal  # not to be built with so few bits
    return replace(ideal, rows=tuple(ideal.rows[k] for k in best_order(models)))


def _remedy(ideal: Filter, *first: str) -> str:
    """Name what would help where a share of the budget cannot be kept to."""
    ways = [*first, "raise output.max_error", "raise output.bits"]
    if ideal.decimation > 1:
        assert ideal.cutoff is not None
        ratio = ideal.sample_rate / ideal.cutoff[-1]
        ways.append(f"decimate by {ideal.decimation} first, as the cutoff is 1/{ratio:.0f} of the sample rate")
    return f"{', '.join(ways[:-1])} or {ways[-1]}"


_IDENTITY = Polynomial(((Fraction(0),), (Fraction(1),)))


def _needs_scaling(port: Port, output: Port) -> bool:
    """Whether the code of a filter's input is anything but a power of two times an output LSB."""
    return port.zero != 0 or _exponent_of_two(port.lsb / output.lsb) is None


def _formats_of(stage: Stage) -> list[Signal]:
    nodes = stage.graph.nodes
    return [Signal(nodes[i].frac, nodes[i].low, nodes[i].high) for i in stage.graph.outputs]


def _format_of(stage: Stage) -> Signal:
    """Format of the only output."""
    (form,) = _formats_of(stage)
    return form


def _filter_budget(proof: CascadeProof) -> dict[str, Fraction]:
    return {"filter coefficients": proof.coefficients.magnitude, "filter rounding": proof.rounding.magnitude}


def _output_stage(signal: Signal, output: Port) -> tuple[OutputStage, Fraction]:
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


def _exponent_of_two(value: Fraction) -> int | None:
    """Exponent k where `value` is 2**k, else None."""
    exponent = value.numerator.bit_length() - value.denominator.bit_length()
    return exponent if value == Fraction(2) ** exponent else None


def _normalised(polynomial: Polynomial, inputs: Sequence[Port], output: Port) -> tuple[tuple[Fraction, ...], ...]:
    """Exact coefficients in the codes' fractions ``code * 2**-bits``, in output LSBs."""
    columns = max(map(len, polynomial.coefficients))
    first = _substitution(inputs[0], len(polynomial.coefficients))
    second = _substitution(inputs[1], columns) if len(inputs) > 1 else [[Fraction(1)]]
    result = [[Fraction(0)] * columns for _ in polynomial.coefficients]
    for i, row in enumerate(polynomial.coefficients):
        for j, a in enumerate(row):
            for p, left in enumerate(first[i]):
                for q, right in enumerate(second[j]):
                    result[p][q] += a * left * right / output.lsb
    return tuple(_trimmed(row) for row in result)


def _trimmed(row: Sequence[Fraction]) -> tuple[Fraction, ...]:
    end = max((k for k, value in enumerate(row) if value), default=0)
    return tuple(row[: end + 1])


def _substitution(port: Port, count: int) -> list[list[Fraction]]:
    """Powers of ``zero + lsb * 2**bits * u`` as coefficients of u."""
    powers = [[Fraction(1)]]
    span = port.lsb * 2**port.bits
    for _ in range(count - 1):
        last = powers[-1]
        powers.append(
            [a * port.zero + b * span for a, b in zip([*last, Fraction(0)], [Fraction(0), *last], strict=True)]
        )
    return powers


def _entries(
    coefficients: tuple[tuple[Fraction, ...], ...], inputs: Sequence[Port], allowed: Fraction
) -> tuple[_Entry, ...]:
    """Polynomials with the fewest fraction bits whose error stays below `allowed` output LSBs, and with fewer."""
    variables = tuple(Variable(name=p.name, bits=p.bits, signed=p.signed) for p in inputs)
    made: list[_Entry] = []
    for frac in range(_MOST_BITS + 1):
        integers = tuple(tuple(round(c * 2**frac) for c in row) for row in coefficients)
        horner = HornerPolynomial(coefficients=integers, frac=frac, variables=variables)
        error = _horner_error(coefficients, horner)
        stages = horner.stages
        made.insert(0, _Entry(stages=stages, signal=_format_of(stages[-1]), error=error))
        if error <= allowed:
            return tuple(made[:_COARSER])
    raise ShortfallError(
        f"the calibration must keep its error below {float(allowed):.3g} output LSB with {_MOST_BITS} fraction bits, "
        f"not {float(error):.3g}: raise output.max_error or output.bits"
    )


def _horner_error(exact: tuple[tuple[Fraction, ...], ...], horner: HornerPolynomial) -> Fraction:
    """Bound on the polynomial's error over all input codes, exact; |u| and |t| are at most one."""
    half = Fraction(1, 2 ** (horner.frac + 1))
    rows = []
    for wanted, made in zip(exact, horner.coefficients, strict=True):
        errors = [abs(w - m * Fraction(1, 2**horner.frac)) for w, m in zip(wanted, made, strict=True)]
        rows.append(sum(errors) + half * (len(errors) - 1))
    return Fraction(sum(rows) + half * (len(rows) - 1))


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


def _values(signal: Signal) -> tuple[Fraction, Fraction]:
    unit = Fraction(2) ** -signal.frac
    return signal.low * unit, signal.high * unit


def _parts(ideal: Filter, realization: str) -> Sequence[Any]:
    return REALIZATIONS[realization].parts(ideal.rows)


def _wide(ideal: Filter, realization: str, bits: int) -> list[StageModel]:
    """Models of the stages with every quantizer at whole output LSBs and no ranges."""
    formats = [SectionFormat(coefficient_bits=bits)] * len(_parts(ideal, realization))
    return [linear_models(stage.graph) for stage in _stages(ideal, realization, formats, Signal(0, -WIDE, WIDE))]


def _coefficient_bits(ideal: Filter, realization: str, signal: Signal, share: Fraction) -> int:
    """Fewest significant bits whose proven effect stays within `share`."""
    sections, ends = ideal_sections(ideal), _values(signal)
    bits = FEWEST_BITS
    while bits <= _MOST_BITS:
        try:
            error = coefficient_extent(_wide(ideal, realization, bits), sections, *ends).magnitude
        except ShortfallError:
            bits += 1  # unstable with so few bits
            continue
        if error <= share:
            return bits
        # An error falls by half with each bit, now and then by more: leap most of the way.
        bits += max(1, math.floor(math.log2(error / share)) - 2)
    raise ShortfallError(
        f"the filter's coefficients must keep their error below {float(share):.3g} output LSB with {_MOST_BITS} "
        f"significant bits each, and do not: {_remedy(ideal)}"
    )


def _fraction_bits(ideal: Filter, realization: str, bits: int, share: Fraction) -> list[dict[str, int]]:
    """Fraction bits of every quantizer so that all their errors together stay within `share`."""
    unit = rounding_gains(_wide(ideal, realization, bits))
    count = sum(map(len, unit))
    fracs = [
        {name: max(0, math.ceil(math.log2(error * count / share))) if error else 0 for name, error in sources.items()}
        for sources in unit
    ]
    _within_limits(fracs, ideal, realization, share)
    # An equal split wastes up to a bit each; give back what the sum allows, the first section first.
    for sources, errors in zip(fracs, unit, strict=True):
        for name in sources:
            total = _total(fracs, unit) + errors[name] * Fraction(2) ** -sources[name]
            if sources[name] > 0 and total <= share:
                sources[name] -= 1
    return fracs


_Fracs = list[dict[str, int]]


def _within_limits(fracs: _Fracs, ideal: Filter, realization: str, share: Fraction) -> _Fracs:
    """Return `fracs` unless there are more than may be."""
    if max((frac for sources in fracs for frac in sources.values()), default=0) > _MOST_BITS:
        better = [] if realization == BEST_KEPT else [f"set hardware.realization to {BEST_KEPT}"]
        raise ShortfallError(
            f"the filter must keep its rounding error below {float(share):.3g} output LSB with {_MOST_BITS} fraction "
            f"bits in each state, and does not: {_remedy(ideal, *better)}"
        )
    return fracs


def _total(fracs: Sequence[Mapping[str, int]], unit: Sequence[Mapping[str, Fraction]]) -> Fraction:
    return sum(
        (
            errors[name] * Fraction(2) ** -sources[name]
            for sources, errors in zip(fracs, unit, strict=True)
            for name in sources
        ),
        Fraction(0),
    )


def _rounded(ideal: Filter, realization: str, bits: int, fracs: Sequence[Mapping[str, int]]) -> list[Words]:
    """Words of stages whose coefficients all have the same significant bits."""
    formats = [SectionFormat(coefficient_bits=bits)] * len(fracs)
    stages = _stages(ideal, realization, formats, Signal(0, -WIDE, WIDE))
    return [Words(stage.coefficients, kept) for stage, kept in zip(stages, fracs, strict=True)]


def _cascade(
    ideal: Filter, realization: str, words: Sequence[Words], signal: Signal
) -> tuple[list[Section], CascadeProof]:
    """Build the stages, prove their ranges, and build them again with these."""
    formats = [
        SectionFormat(coefficient_bits=w.coefficient_bits, coefficients=w.coefficients, fracs=w.fracs) for w in words
    ]
    stages = _stages(ideal, realization, formats, Signal(signal.frac, -WIDE, WIDE))
    proof = prove_cascade([linear_models(s.graph) for s in stages], ideal_sections(ideal), *_values(signal))
    for k, (stage, extents) in enumerate(zip(stages, proof.nodes, strict=True)):
        nodes = stage.graph.nodes
        ranges = {nodes[i].name: _codes(extent, nodes[i].frac) for i, extent in extents.items()}
        formats[k] = replace(formats[k], ranges=ranges)
    return _stages(ideal, realization, formats, signal), proof


def _stages(ideal: Filter, realization: str, formats: Sequence[SectionFormat], signal: Signal) -> list[Section]:
    """Build the stages one after the other, each for what the one before hands on."""
    build = REALIZATIONS[realization].build
    first, beside = signal, list[Signal]()
    stages: list[Section] = []
    for k, (part, form) in enumerate(zip(_parts(ideal, realization), formats, strict=True)):
        entry = replace(form, x_frac=first.frac, x_low=first.low, x_high=first.high, beside=tuple(beside))
        stages.append(build(part, entry, f"section{k}"))
        first, *beside = _formats_of(stages[-1])
    return stages


def _codes(extent: Extent, frac: int) -> tuple[int, int]:
    """Range of codes that holds all values of an extent."""
    unit = Fraction(2) ** frac
    return math.floor(extent.low * unit), math.ceil(extent.high * unit)
