"""Formats that give every part of the error budget an equal share, from exact figures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction

from sosmith.gen.filter.design import Filter
from sosmith.gen.proof.cascade_proof import CascadeProof, coefficient_extent, rounding_gains
from sosmith.gen.realizations.registry import Section
from sosmith.gen.realizations.section_format import MAX_BITS, MIN_BITS, SectionFormat, unknown_range
from sosmith.gen.realizations.tied_formats import groups_of, with_the_most
from sosmith.gen.word_lengths.cascade import cascade, parts_of, stages_of, unquantized
from sosmith.model.dataflow.graph import Range
from sosmith.model.errors import ShortfallError

_Fracs = list[dict[str, int]]


def equally_shared(
    ideal: Filter, realization: str, x: Range, share: Fraction, *, steady: bool = False, tied: bool = False
) -> tuple[Sequence[Section], CascadeProof]:
    """Choose formats with equal shares for coefficients and rounding, and prove the stages.

    Parameters
    ----------
    ideal : Filter
        The filter.
    realization : str
        A key of `REALIZATIONS`.
    x : Range
        Fraction bits and range of the filter's input.
    share : Fraction
        Error allowed for each part, in output LSBs.
    steady : bool
        As for `sosmith.gen.proof.cascade_proof.prove_cascade`.
    tied : bool
        Whether sections of the same structure have the same fraction bits.

    Raises
    ------
    ShortfallError
        If no formats within the limits keep to the error allowed, or the filter has no such realization.
    """
    parts = parts_of(ideal, realization)  # raises here, with its own reason, if there is no such realization
    groups = groups_of(parts, realization) if tied else ()
    bits = _coefficient_bits(ideal, realization, x, share, steady=steady)
    fracs = with_the_most(_fraction_bits(ideal, realization, bits, share), groups)
    while True:
        sections, proof = cascade(ideal, realization, _rounded(ideal, realization, bits, fracs), x, steady=steady)
        if proof.rounding.magnitude <= share:
            return sections, proof
        # A quantizer's error is not centred on zero.
        finer = [{name: frac + 1 for name, frac in sources.items()} for sources in fracs]
        fracs = _within_limits(finer, ideal, share)


def _coefficient_bits(ideal: Filter, realization: str, x: Range, share: Fraction, *, steady: bool) -> int:
    """Fewest significant bits whose proven effect stays within `share`."""
    bits = MIN_BITS
    while bits <= MAX_BITS:
        try:
            models = unquantized(ideal, realization, bits)
            error = coefficient_extent(models, ideal.exact, *x.limits, steady=steady).magnitude
        except ShortfallError:
            bits += 1  # unstable with so few bits
            continue
        if error <= share:
            return bits
        # Each bit halves the error, sometimes more: jump most of the way.
        bits += max(1, math.floor(math.log2(error / share)) - 2)
    raise ShortfallError(
        f"the filter's coefficients must keep their error below {float(share):.3g} output LSB with {MAX_BITS} "
        f"significant bits each, and do not: {_remedy(ideal)}"
    )


def _fraction_bits(ideal: Filter, realization: str, bits: int, share: Fraction) -> list[dict[str, int]]:
    """Fraction bits of every quantizer such that the sum of all their errors stays within `share`."""
    unit = rounding_gains(unquantized(ideal, realization, bits))
    count = sum(map(len, unit))
    fracs = [
        {name: max(0, math.ceil(math.log2(error * count / share))) if error else 0 for name, error in sources.items()}
        for sources in unit
    ]
    _within_limits(fracs, ideal, share)
    # An equal split wastes up to a bit each: remove bits while the sum allows it, starting with the first section.
    for sources, errors in zip(fracs, unit, strict=True):
        for name in sources:
            total = _total(fracs, unit) + errors[name] * Fraction(2) ** -sources[name]
            if sources[name] > 0 and total <= share:
                sources[name] -= 1
    return fracs


def _within_limits(fracs: _Fracs, ideal: Filter, share: Fraction) -> _Fracs:
    """Return `fracs` unless there are too many fraction bits."""
    if max((frac for sources in fracs for frac in sources.values()), default=0) > MAX_BITS:
        raise ShortfallError(
            f"the filter must keep its rounding error below {float(share):.3g} output LSB with {MAX_BITS} fraction "
            f"bits in each state, and does not: {_remedy(ideal)}"
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


def _rounded(ideal: Filter, realization: str, bits: int, fracs: Sequence[Mapping[str, int]]) -> list[SectionFormat]:
    """Return formats of stages whose coefficients all have the same number of significant bits."""
    formats = [SectionFormat(coefficient_bits=bits)] * len(fracs)
    stages = stages_of(ideal, realization, formats, unknown_range(0))
    return [
        SectionFormat(coefficients=stage.coefficients, fracs=kept) for stage, kept in zip(stages, fracs, strict=True)
    ]


def _remedy(ideal: Filter) -> str:
    """Suggest remedies if a part of the budget cannot keep to its share."""
    ways = ["raise output.max_error", "raise output.bits"]
    if ideal.decimation > 1:
        assert ideal.cutoff is not None
        ratio = ideal.sample_rate / ideal.cutoff[-1]
        ways.append(f"decimate by {ideal.decimation} first, as the cutoff is 1/{ratio:.0f} of the sample rate")
    return f"{', '.join(ways[:-1])} or {ways[-1]}"
