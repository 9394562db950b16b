"""A figure of a page: its drawing, its legend and its caption, and values as they stand there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from sosmith.gen.facts.design_tables import ErrorUnit
from sosmith.gen.quantity import quantity
from sosmith.gen.report.evidence import Evidence
from sosmith.gen.report.headlines import unbroken


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A drawing with title, legend and caption.

    Attributes
    ----------
    title, caption : str
        Plain text; the title may be empty.
    drawing : str
        SVG.
    narrow : str
        The same drawing for narrow pages, or ``""`` if one fits all.
    legend : sequence of (str, str, str)
        Role (a colour of the style sheet), shape of the key (a class of it), and words of each entry.
    """

    title: str = ""
    drawing: str
    narrow: str = ""
    caption: str
    legend: Sequence[tuple[str, str, str]] = ()


@dataclass(frozen=True)
class Realized:
    """A section as it is realized: its block diagram, its equations and its coefficients, in lines."""

    section: str
    diagram: str
    equations: Sequence[str]
    coefficients: Sequence[str]


class Figures(NamedTuple):
    """All figures of a report.

    Attributes
    ----------
    figures : dict of str to Figure or None
        By the names that its template has for them; None for one that there is no room for.
    realized : list of Realized
        One for each section.
    """

    figures: dict[str, Figure | None]
    realized: list[Realized]


def error_unit(evidence: Evidence) -> ErrorUnit:
    """Return the unit in which errors stand, which no line is broken before."""
    return ErrorUnit.of(evidence.facts, "\u00a0")


def amount(value: float | None, unit: str) -> str:
    """Return a quantity that no line is broken in."""
    return unbroken(quantity(value, unit))
