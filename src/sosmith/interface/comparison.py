"""Several reports side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from sosmith.gen.report.comparison import Row, column_names, comparison_json, comparison_page, load_report
from sosmith.gen.report.comparison import compare as compare_reports
from sosmith.interface.notebook import table_html
from sosmith.interface.report import Report
from sosmith.model.errors import SpecificationError


@dataclass(frozen=True)
class Comparison:
    """Accuracy reports side by side, as returned by `compare`."""

    reports: tuple[Mapping[str, Any], ...] = field(repr=False)
    """The content of each ``report.json``."""

    @property
    def names(self) -> list[str]:
        """Name of each report, made unique if several are the same."""
        return column_names(self.reports)

    @property
    def rows(self) -> list[Row]:
        """The compared properties: `key`, `title`, `values`, `cells` as text, and the indices of the `best` reports."""
        return compare_reports(self.reports)

    def as_dict(self) -> dict[str, Any]:
        """Return ``{"names": [...], "rows": [{"key", "title", "values", "best"}]}``, in JSON types."""
        return comparison_json(self.reports)

    def page(self) -> str:
        """Return the comparison as a self-contained HTML page."""
        return comparison_page(self.reports)

    def _repr_html_(self) -> str:
        rows = [(row.title, *row.cells) for row in self.rows if row.key != "name"]
        return table_html("Accuracy reports", rows, header=("", *self.names))

    def __repr__(self) -> str:
        return f"<sosmith.Comparison of {', '.join(self.names)}>"


def compare(reports: Sequence[Report | Mapping[str, Any] | str | PathLike[str]]) -> Comparison:
    """Compare accuracy reports side by side.

    Parameters
    ----------
    reports : sequence of Report, path or mapping
        At least one: the result of `Design.simulate`, a ``report.json``, its folder, or its content.

    Raises
    ------
    SpecificationError
        If there are no reports, or a file is not a report.

    Examples
    --------
    >>> import sosmith
    >>> sosmith.compare([])
    Traceback (most recent call last):
    ...
    sosmith.model.errors.SpecificationError: reports must hold at least one report, not none
    """
    if not reports:
        raise SpecificationError("reports must hold at least one report, not none")
    return Comparison(tuple(map(_content, reports)))


def _content(report: Report | Mapping[str, Any] | str | PathLike[str]) -> Mapping[str, Any]:
    if isinstance(report, Report):
        return report.summary
    return report if isinstance(report, Mapping) else load_report(Path(fspath(report)))
