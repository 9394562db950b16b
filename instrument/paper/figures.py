"""Figures printed in the paper, with all their digits and their places."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any

_PATH = Path(__file__).with_name("paper.toml")


class PaperFigures:
    """The printed figures by table and name, as in ``data/paper.toml``.

    A figure is a `Decimal` with exactly the printed digits, so that its precision is known.

    Parameters
    ----------
    tables : mapping
        Tables by name, such as ``"equation_4"``: names to numbers, lists of numbers, lists of these, and ``"where"``.
    """

    def __init__(self, tables: Mapping[str, Mapping[str, Any]]) -> None:
        self.tables = tables

    def where(self, table: str) -> str:
        """Place in the paper of a table of figures."""
        return str(self.tables[table]["where"])

    def number(self, table: str, name: str) -> Decimal:
        """Return a single figure."""
        return Decimal(self.tables[table][name])

    def numbers(self, table: str, name: str) -> tuple[Decimal, ...]:
        """Return a list of figures."""
        return tuple(Decimal(value) for value in self.tables[table][name])

    def rows(self, table: str, name: str) -> tuple[tuple[Decimal, ...], ...]:
        """Return rows of figures."""
        return tuple(tuple(Decimal(value) for value in row) for row in self.tables[table][name])


def read_paper_figures(path: Path = _PATH) -> PaperFigures:
    """Read the printed figures from the TOML file that comes with the package, or from `path`."""
    with path.open("rb") as file:
        return PaperFigures(tomllib.load(file, parse_float=Decimal))
