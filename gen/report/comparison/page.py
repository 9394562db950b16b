"""The page of a comparison: the verdict first, then what differs, the figures, and the curves overlaid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from sosmith.gen.report.comparison.baseline import Judgement
from sosmith.gen.report.comparison.choice import choose
from sosmith.gen.report.comparison.differences import alike, differences
from sosmith.gen.report.comparison.fairness import fairness
from sosmith.gen.report.comparison.pictures import error_figure, response_figure, spectrum_figure, standing_figure
from sosmith.gen.report.comparison.report_file import Report
from sosmith.gen.report.comparison.rows import Row, column_names, compare
from sosmith.model.templates import render

TITLES = {
    "run": "What ran",
    "accuracy": "Accuracy on this trace",
    "bounds": "Bounds over all inputs in range",
    "filter": "The filter",
    "clocks": "Clocks",
    "cost": "Cost",
    "simulation": "Speed of the simulation",
}
"""Titles of the groups of rows; the last says nothing about the designs."""


class Group(NamedTuple):
    """Rows under one title, and why they have no winner (may be empty)."""

    title: str
    rows: list[Row]
    unfair: str


def groups(reports: Sequence[Report]) -> list[Group]:
    """Rows of a comparison by group, without the names and without empty groups."""
    rows, reasons = compare(reports), vars(fairness(reports))
    all_groups = [
        Group(title, [row for row in rows if row.group == key and row.key != "name"], reasons.get(key, ""))
        for key, title in TITLES.items()
    ]
    return [group for group in all_groups if group.rows]


def comparison_page(reports: Sequence[Report], judgements: Sequence[Judgement] = ()) -> str:
    """One HTML page that stands alone; with `judgements`, which then come first, the first report is the baseline."""
    names = column_names(reports, baseline=bool(judgements))
    choice = choose(reports, names)
    figures = (error_figure(reports, names), spectrum_figure(reports, names), response_figure(reports, names))
    return render(
        "sosmith.gen.report",
        "comparison.html.jinja",
        names=names,
        passed=[bool(report["passed"]) for report in reports],
        choice=choice,
        judgements=judgements,
        differences=differences(reports),
        alike=alike(reports),
        groups=groups(reports),
        standing=standing_figure(reports, names, choice),
        figures=[figure for figure in figures if figure is not None],
    )
