"""Coefficients of an FIR filter: the coarsest grid that keeps to the error allowed.

An FIR filter rounds nothing, and each coefficient's error adds ``|b - b'| max |x|``: the bound is a sum that an input
attains. So there is nothing to search for but the grid, the same for all coefficients, as the longest fraction alone
decides how wide the sums are. Where products are made of adders, what is left of the error allowed is spent on
coefficients with fewer signed digits, first where a digit costs least.
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
from sosmith.gen.realizations.section_format import SectionFormat
from sosmith.gen.word_lengths.bit_limits import MAX_BITS
from sosmith.gen.word_lengths.cascade import cascade
from sosmith.model.dataflow.adder_graph import signed_digits
from sosmith.model.dataflow.graph import Range
from sosmith.model.errors import ShortfallError

Codes = Mapping[str, tuple[int, int]]


def fir_stages(
    ideal: Filter, realization: str, x: Range, allowed: Fraction, *, steady: bool = False, few_digits: bool = False
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
        codes = _of_few_digits(ideal, wanted, nearest, windows, allowed) if few_digits else nearest
        for chosen in (codes, nearest):
            made = _proven(ideal, realization, chosen, x, steady=steady)
            if made[1].coefficients.magnitude <= allowed:
                return made
    raise ShortfallError(
        f"the filter's coefficients must keep their error below {float(allowed):.3g} output LSB with {MAX_BITS} bits, "
        "and do not: raise output.max_error or raise output.bits"
    )


def _proven(
    ideal: Filter, realization: str, codes: Codes, x: Range, *, steady: bool
) -> tuple[Sequence[Section], CascadeProof]:
    formats = [SectionFormat(coefficients={name: lowest_terms(*code) for name, code in codes.items()})]
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


def _of_few_digits(
    ideal: Filter,
    wanted: Sequence[Coefficient],
    nearest: Codes,
    windows: Sequence[tuple[Fraction, Fraction]],
    allowed: Fraction,
) -> Codes:
    """Give coefficients fewer signed digits, one by one, each time where a digit costs the least error."""
    codes = nearest
    error = _error(_deviations(ideal, wanted, codes), windows)
    while True:
        best: tuple[Fraction, Codes, Fraction] | None = None
        for c in wanted:
            integer, frac = codes[c.name]
            for near in with_fewer_digits(integer, math.ldexp(c.value, frac)) if integer else ():
                candidate = {**codes, c.name: (near, frac)}
                after = _error(_deviations(ideal, wanted, candidate), windows)
                saved = len(signed_digits(integer)) - len(signed_digits(near))
                merit = (after - error) / saved
                if after <= allowed and (best is None or merit < best[0]):
                    best = merit, candidate, after
        if best is None:
            return codes
        _, codes, error = best
