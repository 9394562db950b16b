"""Makes lattice wave digital filters: decomposes a filter into two allpass branches and finds their coefficients.

A filter is a lattice if ``H = (s0 A0 + s1 A1) / 2`` with allpass functions A0 and A1, each of which has some of the
poles. Butterworth, Chebyshev and elliptic low-pass and high-pass filters of odd order are lattices, and so are
band-pass and band-stop filters derived from them. A lattice is determined by the split of its poles, so all splits
are tried; either one of them gives H, or the filter is not a lattice.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from sosmith.model.dataflow.graph import Range
from sosmith.model.errors import ShortfallError
from sosmith.model.sections.lattice import LANES, Adaptor, Allpass, LatticeJoin, LatticeStage
from sosmith.model.sections.state_space import Coefficient

Row = Sequence[float]
Denominator = tuple[Fraction, ...]
"""(1, a1) or (1, a1, a2) of an allpass section."""

Rounding = Callable[[str, float], tuple[int, int]]
"""Rounds a coefficient, given its name and ideal value, to an integer and its fraction bits."""

_CLOSE = 1e-8
"""Largest allowed difference between a lattice and the filter at any frequency, relative to the largest gain. It is
well above the double-precision errors of the designs in tests/gen/word_lengths/test_sweep.py, and well below the
difference of any filter that is not a lattice. The proof covers the remaining difference."""

_MAX_GROUPS = 16  # of poles; all splits between the two branches are tried
_NOTHING = 1e-13  # a coefficient this small is a rounding error of the design
_FREQUENCIES = 24

Spectrum = npt.NDArray[np.complex128]


@dataclass(frozen=True)
class LatticePair:
    """Part for one stage: the denominators of the sections in its two branches, None for a wire."""

    lanes: tuple[Denominator | None, Denominator | None]


@dataclass(frozen=True)
class LatticeSigns:
    """Part for the last stage: s0 and s1."""

    signs: tuple[int, int]


Part = LatticePair | LatticeSigns


def lattice_parts(rows: Sequence[Row]) -> tuple[Part, ...]:
    """Decompose a filter into the parts that the stages of its lattice are made from.

    Parameters
    ----------
    rows : sequence of sequence of float
        b0, b1, b2, 1, a1, a2 of each ideal section, stable.

    Raises
    ------
    ShortfallError
        If the filter is not a lattice.
    """
    return _parts(tuple(tuple(row) for row in rows))


@lru_cache(maxsize=64)
def _parts(rows: tuple[tuple[float, ...], ...]) -> tuple[Part, ...]:
    groups = _groups(rows)
    found = _shared_out(rows, groups) if 0 < len(groups) <= _MAX_GROUPS else None
    if found is None:
        raise ShortfallError(
            "lattice_wdf must have a filter that is half the sum or difference of two allpass filters, as Butterworth, "
            "Chebyshev and elliptic filters of odd order are, or a band-pass or band-stop made from one: choose an odd "
            "order or another realization"
        )
    upper, signs = found
    lanes = [[group for k, group in enumerate(groups) if (k in upper) == first] for first in (True, False)]
    count = max(map(len, lanes))
    padded = [[*lane, *[None] * (count - len(lane))] for lane in lanes]
    return *(LatticePair((a, b)) for a, b in zip(*padded, strict=True)), LatticeSigns(signs)


def _groups(rows: Sequence[tuple[float, ...]]) -> list[Denominator]:
    """Denominators of the allpass sections: one for each pair of complex poles and for each real pole.

    They are exact for complex poles. Poles at zero are added if there are more zeros than other poles.
    """
    groups: list[Denominator] = []
    zeros = 0
    for row in rows:
        zeros += max(k for k, b in enumerate(row[:3]) if b or k == 0)
        a1, a2 = Fraction(row[4]), Fraction(row[5])
        if a1 * a1 < 4 * a2:
            groups.append((Fraction(1), a1, a2))
        else:
            groups += [(Fraction(1), -pole) for pole in _real_poles(a1, a2) if pole]
    present = sum(len(group) - 1 for group in groups)
    groups += [(Fraction(1), Fraction(0))] * max(zeros - present, 0)
    return sorted(groups, key=_angle)


def _angle(group: Denominator) -> float:
    if len(group) == 2:
        return 0.0 if group[1] <= 0 else math.pi
    return math.acos(max(-1.0, min(1.0, -float(group[1]) / (2 * math.sqrt(group[2])))))


def _real_poles(a1: Fraction, a2: Fraction) -> list[Fraction]:
    """Roots of ``z**2 + a1 z + a2``, by their distances from 1 or -1, without cancellation."""
    side = -1 if a1 > 0 else 1
    middle = (2 + side * a1) / 2
    product = 1 + side * a1 + a2
    far = -(float(middle) + math.sqrt(max(float(middle * middle - product), 0.0)))
    near = float(product) / far
    return [side * (1 + Fraction(distance)) for distance in (near, far)]


def _shared_out(
    rows: Sequence[tuple[float, ...]], groups: Sequence[Denominator]
) -> tuple[set[int], tuple[int, int]] | None:
    """Which of `groups` belong to the upper branch, and the signs of the branches; None if there is no lattice.

    The phases of allpass sections differ most near their poles, so the candidates are compared at frequencies there
    and in between.
    """
    w = np.exp(-1j * _frequencies(groups))
    wanted = np.prod([_value(row[:3], w) / _value(row[3:], w) for row in rows], axis=0)
    sections = [_value(group[::-1], w) / _value(group, w) for group in groups]
    upper = lower = np.ones((1, len(w)), dtype=np.complex128)
    for section in sections:  # bit k of an index is set if section k is in the upper branch
        upper, lower = np.concatenate([upper, upper * section]), np.concatenate([lower * section, lower])
    best, choice, signs = math.inf, 0, (1, 1)
    for s0, s1 in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        errors = np.abs((s0 * upper + s1 * lower) / 2 - wanted).max(axis=1)
        index = int(errors.argmin())
        if errors[index] < best - _CLOSE:
            best, choice, signs = float(errors[index]), index, (s0, s1)
    if best > _CLOSE:
        return None
    return {k for k in range(len(groups)) if choice >> k & 1}, signs


def _frequencies(groups: Sequence[Denominator]) -> npt.NDArray[np.float64]:
    """Angular frequencies at the poles, around them (spaced by the distance to the unit circle), and on a grid."""
    found = list(np.linspace(0, math.pi, _FREQUENCIES))
    for group in groups:
        angle = _angle(group)
        distance = 1 - (math.sqrt(group[2]) if len(group) == 3 else abs(float(group[1])))
        found += [angle, angle - distance, angle + distance, angle + 3 * distance]
    return np.asarray(np.abs(found), dtype=np.float64)


def _value(coefficients: Sequence[Fraction] | Sequence[float], w: Spectrum) -> Spectrum:
    return np.asarray(np.polyval([float(c) for c in coefficients[::-1]], w), dtype=np.complex128)


def lattice_stage(
    part: Part,
    *,
    name: str,
    rounding: Rounding,
    entries: Sequence[Range],
    fracs: Mapping[str, int],
    ranges: Mapping[str, tuple[int, int]],
    wide: tuple[int, int],
) -> LatticeStage | LatticeJoin:
    """Make a stage.

    Parameters
    ----------
    part : Part
        One of `lattice_parts`.
    name : str
        Its name.
    rounding : callable
        Rounds the coefficients.
    entries : sequence of Range
        Fraction bits and range of each input's code; a single one drives both branches.
    fracs : mapping of str to int
        Fraction bits kept by the quantizers of ``upper_x1_sum`` and the like; if missing, those of the branch's input.
    ranges : mapping of str to tuple of int
        Smallest and largest code of ``upper_x1_next`` and the like.
    wide : tuple of int
        Range of a code that `ranges` does not name.

    Raises
    ------
    ShortfallError
        If the rounded coefficients are unstable.
    """
    upper, lower = ([*entries] * 2)[:2]
    if isinstance(part, LatticeSigns):
        return LatticeJoin(name=name, signs=part.signs, entries=(upper, lower))

    def section(lane: str, denominator: Denominator, entry: Range) -> Allpass:
        def form(kept: str, bounded: str) -> Range:
            return Range(fracs.get(f"{lane}_{kept}", entry.frac), *ranges.get(f"{lane}_{bounded}", wide))

        ideal = _adaptors(denominator)
        names = ("g",) if len(ideal) == 1 else ("g1", "g2")
        # An inner coefficient of zero makes two delays in series, between which nothing is quantized.
        second, inner = ("x1_sum", "x1_sum") if ideal[1:] == [(0, 0.0)] else ("x2_sum", "inner_sum")
        return Allpass(
            adaptors=tuple(
                Adaptor(near, Coefficient(*rounding(f"{lane}_{g}", rest)))
                for g, (near, rest) in zip(names, ideal, strict=True)
            ),
            states=(form("x1_sum", "x1_next"), form(second, "x2_next"))[: len(ideal)],
            inner=form(inner, "inner"),
            output=form("y_sum", "y"),
        )

    try:
        first, second = (
            None if denominator is None else section(lane, denominator, entry)
            for lane, denominator, entry in zip(LANES, part.lanes, (upper, lower), strict=True)
        )
    except ValueError as error:
        raise ShortfallError(f"{name} must be stable with its coefficients rounded: {error}") from None
    return LatticeStage(name=name, lanes=(first, second), entries=tuple(entries))


def _adaptors(denominator: Denominator) -> list[tuple[int, float]]:
    """For each adaptor, the nearest of -1, 0 and 1 to its coefficient, and the remainder."""
    if len(denominator) == 2:
        return [_split(-denominator[1])]
    _, a1, a2 = denominator
    return [_split(-a2), _split(-a1 / (1 + a2))]


def _split(g: Fraction) -> tuple[int, float]:
    near = round(g)
    rest = float(g - near)
    return near, rest if abs(rest) > _NOTHING else 0.0
