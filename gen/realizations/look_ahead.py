"""Makes sections with scattered look-ahead: the polynomials that double the distance of the recursion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

from sosmith.gen.realizations.coefficients import Rounding
from sosmith.gen.realizations.direct_form import numerator_terms
from sosmith.model.dataflow.graph import Range
from sosmith.model.errors import ShortfallError
from sosmith.model.sections.direct_form import Product
from sosmith.model.sections.look_ahead import Limits, LookAhead, Tap

Row = Sequence[float]

_NAMES = "abcdefgh"
"""Letters of the polynomials in front of the recursion: a1 and a2 of the first one, b1 and b2 of the second."""


def look_ahead(
    row: Row,
    *,
    name: str,
    doublings: int,
    rounding: Rounding,
    x: Range,
    fracs: Mapping[str, int],
    ranges: Mapping[str, Limits],
    wide: Limits,
) -> LookAhead:
    """Make a section.

    Parameters
    ----------
    row : sequence of float
        b0, b1, b2, 1, a1, a2.
    name : str
        Its name.
    doublings : int
        Base-2 logarithm of the samples that the recursion goes back at once.
    rounding : Rounding
        Rounds the coefficients.
    x : Range
        Fraction bits and range of the input's code.
    fracs : mapping of str to int
        Fraction bits kept by the quantizers of u0, u1, .. and v. If the mapping is empty, all keep as many as the input
        has; otherwise a missing one keeps all, because it had nothing to drop.
    ranges : mapping of str to tuple of int
        Ranges of the codes of u0, u1, .. and v.
    wide : tuple of int
        Range of a code that `ranges` does not name.

    Raises
    ------
    ShortfallError
        If the section passes nothing, or its rounded coefficients are unstable.
    """
    terms = [
        Product(f"B{label[1:]}", *rounding(f"B{label[1:]}", value), taps, (0, 0), shift)
        for label, value, taps, _, shift in numerator_terms(row)
        if value
    ]
    if not terms:
        raise ShortfallError(f"numerator of {name} must not be zero")
    *factors, recursion = (_taps(rounding, *made) for made in polynomials(row, doublings))
    most = x.frac if not fracs else _ALL
    try:
        return LookAhead(
            name=name,
            numerator=tuple(terms),
            factors=tuple(factors),
            recursion=recursion,
            x=x,
            fracs=tuple(fracs.get(f"u{k}", most) for k in range(doublings + 1)),
            ranges=tuple(ranges.get(f"u{k}", wide) for k in range(doublings + 1)),
            y_frac=fracs.get("v", most),
            v_range=ranges.get("v", wide),
        )
    except ValueError as error:
        raise ShortfallError(f"{name} must be stable with coefficients of {rounding.bits} bits: {error}") from None


_ALL = 1 << 12
"""More fraction bits than any signal has."""


def polynomials(row: Row, doublings: int) -> list[tuple[str, dict[int, Fraction]]]:
    """Polynomials of a section with look-ahead, each as a letter and its coefficients by their delays, without the one.

    All but the last stand in front of the recursion; the last one is the denominator.

    >>> polynomials([1, 0, 0, 1, -1, 0.5], 1)
    [('a', {1: Fraction(1, 1), 2: Fraction(1, 2)}), ('A', {2: Fraction(0, 1), 4: Fraction(1, 4)})]
    """
    first, second = Fraction(row[4]), Fraction(row[5])
    found = []
    for k in range(doublings):
        found.append((_NAMES[k], {1 << k: -first, 2 << k: second}))
        first, second = 2 * second - first**2, second**2
    return [*found, ("A", {1 << doublings: first, 2 << doublings: second})]


def _taps(rounding: Rounding, letter: str, weights: Mapping[int, Fraction]) -> tuple[Tap, ...]:
    """Round a polynomial's coefficients; those that are too small for a double are none."""
    names = [f"{letter}{k}" for k in (1, 2)]
    return tuple(
        Tap(name, *rounding(name, float(value)), delay)
        for name, (delay, value) in zip(names, weights.items(), strict=True)
        if float(value)
    )
