"""Finds the sign convention of given sections, and brings them to that of scipy with a0 = 1.

Tools disagree on the signs of a1 and a2. A file rarely says which it means, but only one choice is stable as a rule: a
pair of poles with radius near 1 has a2 near 1 in scipy's convention, and near -1 in the other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from sosmith.gen.quantity import count
from sosmith.gen.specification.coefficients.content import Row, Signs, StatedSections
from sosmith.model.errors import SpecificationError

_OTHER: dict[Signs, Signs] = {"scipy": "negated", "negated": "scipy"}
_LARGEST = 10**30
"""Largest magnitude of a coefficient, far beyond what hardware could have."""

_WORDS: dict[Signs, str] = {"scipy": "scipy's signs of a1 and a2", "negated": "the signs of a1 and a2 negated"}


@dataclass(frozen=True, kw_only=True)
class SettledSections:
    """Stable sections in scipy's convention.

    Attributes
    ----------
    rows : tuple of Row
        (b0, b1, b2, 1, a1, a2); scale values are part of the numerators.
    signs : Signs
        The convention that the file was read in.
    certain : bool
        Whether the other convention is unstable.
    """

    rows: tuple[Row, ...]
    signs: Signs
    certain: bool

    @property
    def gains(self) -> tuple[Fraction, Fraction]:
        """Exact gain at 0 Hz and at half the sample rate, with sign."""
        return response(self.rows, 1), response(self.rows, -1)


def settled(stated: StatedSections, asked: Signs | None = None) -> SettledSections:
    """Bring sections to scipy's convention.

    Parameters
    ----------
    stated : StatedSections
    asked : Signs or None
        The convention to read the file in; None takes the one that is stable, and that of the format if both are.

    Raises
    ------
    SpecificationError
        If a0 or a whole numerator is 0, a numerator is below 1e-30, a coefficient beyond 1e30, the number of scale
        values fits no rule, or no allowed convention is stable.

    Examples
    --------
    >>> rows = ((Fraction(1), Fraction(0), Fraction(0), Fraction(1), Fraction("1.8"), Fraction("-0.9")),)
    >>> sections = settled(StatedSections(format="a table", rows=rows))
    >>> sections.signs, [float(value) for value in sections.rows[0][4:]]
    ('negated', [-1.8, 0.9])
    """
    normal = _scaled([_normalized(k, row) for k, row in enumerate(stated.rows)], stated.gains)
    for k, row in enumerate(normal):
        if max(map(abs, row)) > _LARGEST:
            raise SpecificationError(f"section {k} must have coefficients within 1e30 for a0 = 1, not beyond")
        if max(map(abs, row[:3])) * _LARGEST < 1:
            raise SpecificationError(f"section {k} must have a b of at least 1e-30 for a0 = 1, not all below")
    choices: dict[Signs, tuple[Row, ...]] = {"scipy": normal, "negated": tuple(map(_negated, normal))}
    stable: list[Signs] = [signs for signs, rows in choices.items() if all(map(_is_stable, rows))]
    if asked is not None:
        if asked not in stable:
            raise SpecificationError(f"sections must be stable with {_WORDS[asked]}, not {_trouble(choices[asked])}")
        signs = asked
    elif not stable:
        raise SpecificationError(
            f"sections must be stable, not {_trouble(choices['scipy'])} with {_WORDS['scipy']}, "
            f"and {_trouble(choices['negated'])} with {_WORDS['negated']}"
        )
    else:
        signs = stated.signs if stated.signs in stable else stable[0]
    return SettledSections(rows=choices[signs], signs=signs, certain=_OTHER[signs] not in stable)


def sentence(stated: StatedSections, sections: SettledSections) -> str:
    """Say what the file is and in which convention it was read, and why."""
    other = _OTHER[sections.signs]
    why = f"with {_WORDS[other]} it would be unstable" if sections.certain else "as its format says; both are stable"
    read = count(len(sections.rows), "second-order section")
    return f"{read} from {stated.format}, read with {_WORDS[sections.signs]}: {why}"


def response(rows: Sequence[Row], z: int) -> Fraction:
    """Exact response of sections at z = 1 or -1."""
    value = Fraction(1)
    for b0, b1, b2, a0, a1, a2 in rows:
        value *= (b0 + b1 * z + b2) / (a0 + a1 * z + a2)
    return value


def _normalized(k: int, row: Row) -> Row:
    if row[3] == 0:
        raise SpecificationError(f"section {k} must have a nonzero a0, not 0")
    if not any(row[:3]):
        raise SpecificationError(f"section {k} must have at least one nonzero b, not b0 = b1 = b2 = 0")
    return tuple(value / row[3] for value in row)


def _scaled(rows: Sequence[Row], gains: Sequence[Fraction]) -> tuple[Row, ...]:
    """Multiply scale values into the numerators: a single one into the first, one beyond the last section into that."""
    if len(gains) not in (0, 1, len(rows), len(rows) + 1):
        raise SpecificationError(
            f"scale values must be 1, {len(rows)} or {len(rows) + 1} for {len(rows)} sections, not {len(gains)}"
        )
    factors = [*gains[: len(rows)], *[Fraction(1)] * (len(rows) - len(gains))]
    factors[-1] *= math.prod(gains[len(rows) :])
    if not all(factors):
        raise SpecificationError("scale values must be nonzero, not 0")
    return tuple((*(b * factor for b in row[:3]), *row[3:]) for row, factor in zip(rows, factors, strict=True))


def _negated(row: Row) -> Row:
    return (*row[:4], -row[4], -row[5])


def _is_stable(row: Row) -> bool:
    """Jury's criterion for two poles strictly inside the unit circle."""
    a1, a2 = row[4:]
    return abs(a2) < 1 and abs(a1) < 1 + a2


def _trouble(rows: Sequence[Row]) -> str:
    k = next(k for k, row in enumerate(rows) if not _is_stable(row))
    a1, a2 = map(float, rows[k][4:])
    root = math.sqrt(abs(a1 * a1 / 4 - a2))
    radius = math.sqrt(a2) if a1 * a1 / 4 < a2 else abs(a1) / 2 + root
    return f"a pole of radius {radius:.6g} in section {k}"
