"""Coefficients of an FIR filter: the coarsest grid that keeps to the error allowed.

An FIR filter rounds nothing, and each coefficient's error adds ``|b - b'| max |x|``: the bound is a sum that an input
attains. So there is nothing to search for but the grid, the same for all coefficients, as the longest fraction alone
decides how wide the sums are. Large coefficients are cut to the bits that a multiplier takes, if a grid that is a
little finer for the others makes up for it. Where products are made of adders, what is left of the error allowed is
spent on coefficients with fewer signed digits, first where a digit costs least.

Where other coefficients can be loaded, the grid is so fine that any of this size keep to the error, and all are kept on
it: those of the design might need fewer bits.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction

from sosmith.gen.filter.design import Filter
from sosmith.gen.proof.cascade_proof import CascadeProof
from sosmith.gen.realizations.coefficients import lowest_terms, with_fewer_digits
from sosmith.gen.realizations.fir import Coefficient, coefficients_of, on_grid
from sosmith.gen.realizations.registry import Section
from sosmith.gen.realizations.section_format import MAX_BITS, SectionFormat
from sosmith.gen.word_lengths.cascade import cascade
from sosmith.model.dataflow.adder_graph import signed_digits
from sosmith.model.dataflow.graph import Range
from sosmith.model.errors import ShortfallError

_FINER = 3
"""Most fraction bits by which the grid may become finer where large coefficients are cut to fit a multiplier."""

Codes = Mapping[str, tuple[int, int]]


def fir_stages(
    ideal: Filter,
    realization: str,
    x: Range,
    allowed: Fraction,
    *,
    steady: bool = False,
    few_digits: bool = False,
    factor_bits: int | None = None,
    loads: bool = False,
) -> tuple[Sequence[Section], CascadeProof]:
    """Choose the coefficients of an FIR filter, and prove the stage.

    Parameters
    ----------
    ideal : Filter
        The filter, one row.
    realization : str
        One of `sosmith.gen.realizations.registry.FIR`.
    x : Range
        Fraction bits and range of the filter's input.
    allowed : Fraction
        Error allowed for the coefficients, in output LSBs.
    steady : bool
        As for `sosmith.gen.proof.cascade_proof.prove_cascade`.
    few_digits : bool
        Whether coefficients of fewer signed digits take less.
    factor_bits : int or None
        Bits, with a sign, to which coefficients are cut where the error allows it; None for no such limit.
    loads : bool
        Whether other coefficients can be loaded.

    Raises
    ------
    ShortfallError
        If no grid within the limits keeps to the error allowed.
    """
    (row,) = ideal.rows
    wanted = coefficients_of(row)
    windows = [(Fraction(0), x.limits[1]), (x.limits[0], Fraction(0))] if steady else [x.limits]
    largest = math.frexp(max((abs(c.value) for c in wanted), default=1.0))[1]
    for frac in range(1 - largest, MAX_BITS + 1 - largest):
        nearest = on_grid(wanted, frac)
        if _error(_deviations(ideal, wanted, nearest), windows) > allowed:
            continue
        if loads and _rounding(wanted, nearest, windows) > allowed:
            continue
        fitting = [] if factor_bits is None else _fitting(ideal, wanted, frac, factor_bits, windows, allowed)
        if loads:
            fitting = [codes for codes in fitting if _rounding(wanted, codes, windows) <= allowed]
        elif few_digits:
            fitting = [_of_few_digits(ideal, wanted, nearest, windows, allowed)]
        for chosen in (*fitting, nearest):
            shortest = chosen if loads else {name: lowest_terms(*code) for name, code in chosen.items()}
            sections, proof = _proven(ideal, realization, shortest, x, steady=steady)
            if proof.coefficients.magnitude <= allowed:
                return sections, proof
    if not allowed:
        raise ShortfallError(
            f"the filter's taps must be whole numbers of up to {MAX_BITS} bits times a power of two to be made of "
            "adders alone, and are not"
        )
    raise ShortfallError(
        f"the filter's coefficients must keep their error below {float(allowed):.3g} output LSB with {MAX_BITS} bits, "
        "and do not: raise output.max_error or raise output.bits"
    )


def _fitting(
    ideal: Filter,
    wanted: Sequence[Coefficient],
    frac: int,
    bits: int,
    windows: Sequence[tuple[Fraction, Fraction]],
    allowed: Fraction,
) -> list[Codes]:
    """Return coefficients of so many bits at most, with little more than `frac` fraction bits, if the error allows."""
    for finer in range(frac, frac + _FINER + 1):
        cut = [min(finer, bits - 1 - math.frexp(abs(c.value))[1]) for c in wanted]
        codes = {c.name: on_grid([c], places)[c.name] for c, places in zip(wanted, cut, strict=True)}
        if _error(_deviations(ideal, wanted, codes), windows) <= allowed:
            return [codes]
    return []


def _proven(
    ideal: Filter, realization: str, codes: Codes, x: Range, *, steady: bool
) -> tuple[Sequence[Section], CascadeProof]:
    formats = [SectionFormat(coefficients=dict(codes))]
    return cascade(ideal, realization, formats, x, steady=steady)


def _deviations(ideal: Filter, wanted: Sequence[Coefficient], codes: Codes) -> list[Fraction]:
    """Return the difference of each tap from the exact one."""
    ((exact, _),) = ideal.exact
    taps = [-tap for tap in exact] + [Fraction(0)] * (len(ideal.rows[0]) // 2 - len(exact))
    for c in wanted:
        integer, frac = codes[c.name]
        for delay, sign in c.taps:
            taps[delay] += sign * integer * Fraction(2) ** -frac
    return taps


def _error(deviations: Sequence[Fraction], windows: Sequence[tuple[Fraction, Fraction]]) -> Fraction:
    """Largest output of a filter for inputs within a window that contains 0, or after all of them have come."""
    ends = [[(d * low, d * high) for d in deviations] for low, high in windows]
    return max(abs(sum(map(pick, each), Fraction(0))) for each in ends for pick in (min, max))


def _rounding(wanted: Sequence[Coefficient], codes: Codes, windows: Sequence[tuple[Fraction, Fraction]]) -> Fraction:
    """Bound the error of any coefficients on the grids of these: half a step of each, at the largest input."""
    largest = max(abs(end) for window in windows for end in window)
    return sum((len(c.taps) * largest * Fraction(2) ** -(codes[c.name][1] + 1) for c in wanted), Fraction(0))


def _of_few_digits(
    ideal: Filter,
    wanted: Sequence[Coefficient],
    nearest: Codes,
    windows: Sequence[tuple[Fraction, Fraction]],
    allowed: Fraction,
) -> Codes:
    """Give coefficients fewer signed digits, one by one, each time where a digit costs the least error.

    Errors of several coefficients are added up as if each were the worst, and always of the same sign.
    """
    largest = max(abs(end) for window in windows for end in window)
    ways = [_near(c, *nearest[c.name], largest) for c in wanted]
    left = allowed - _error(_deviations(ideal, wanted, nearest), windows)
    taken = [0] * len(ways)
    while True:
        steps = []
        for k, way in enumerate(ways):
            digits, _, error = way[taken[k]]
            for j in range(taken[k] + 1, len(way)):
                more = way[j][2] - error
                if more <= left:
                    steps.append((more / (digits - way[j][0]), k, j))
        if not steps:
            break
        _, k, j = min(steps)
        left -= ways[k][j][2] - ways[k][taken[k]][2]
        taken[k] = j
    return {c.name: (ways[k][taken[k]][1], nearest[c.name][1]) for k, c in enumerate(wanted)}


def _near(c: Coefficient, integer: int, frac: int, largest: Fraction) -> list[tuple[int, int, Fraction]]:
    """Return integers near a coefficient with ever fewer signed digits: their digits, they, and the error of each."""
    unit = len(c.taps) * largest * Fraction(2) ** -frac
    scaled = Fraction(c.value) * Fraction(2) ** frac
    choices = [(len(signed_digits(integer)), integer, abs(integer - scaled) * unit)]
    near = {
        value: len(signed_digits(value)) for value in (with_fewer_digits(integer, float(scaled)) if integer else ())
    }
    for digits in range(choices[0][0] - 1, 0, -1):
        best = min((value for value in near if near[value] == digits), key=lambda v: (abs(v - scaled), v), default=None)
        if best is not None:
            choices.append((digits, best, abs(best - scaled) * unit))
    return choices
