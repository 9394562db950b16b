"""Several accuracy reports side by side: as rows for a table, as JSON, as a page in the look of the reports."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from reprlib import repr as shortened
from typing import Any

from sosmith.gen.quantity import decibels, plain_number, quantity
from sosmith.gen.report.page import Figure
from sosmith.gen.report.plots import NARROW, WIDE, ranking_figure
from sosmith.model.errors import SpecificationError
from sosmith.model.templates import render

Report = Mapping[str, Any]

_NUMBER = (int, float)
_OPTIONAL = (int, float, type(None))
_REQUIRED: dict[tuple[str, ...], tuple[type, ...]] = {
    ("name",): (str,),
    ("realization",): (str,),
    ("simulator",): (str,),
    ("passed",): (bool,),
    ("bit_exact",): (bool,),
    ("samples",): (int,),
    ("cycles_per_sample",): _OPTIONAL,
    ("error", "unit"): (str,),
    ("error", "max_abs"): _NUMBER,
    ("error", "max_lsb"): _NUMBER,
    ("error", "rms"): _NUMBER,
    ("error", "bound"): _OPTIONAL,
    ("sqnr_db",): _OPTIONAL,
    ("accuracy_percent", "unfiltered"): _OPTIONAL,
    ("accuracy_percent", "golden"): _OPTIONAL,
    ("accuracy_percent", "hardware"): _OPTIONAL,
}


@dataclass(frozen=True, kw_only=True)
class Row:
    """One property of all compared reports.

    Attributes
    ----------
    key : str
        Its name in `report.json`, with dots.
    title : str
        Its name for people.
    values : tuple
        As in the reports, None where unknown, in the order of the reports.
    cells : tuple of str
        The values as plain text, with units.
    best : tuple of int
        Indices of the best reports; empty where best has no meaning, all are equal, or units differ.
    """

    key: str
    title: str
    values: tuple[Any, ...]
    cells: tuple[str, ...]
    best: tuple[int, ...]


def load_report(path: Path) -> dict[str, Any]:
    """Read a report from its `report.json` or the folder that holds it.

    Raises
    ------
    SpecificationError
        If it cannot be read or is not a report.
    """
    file = path / "report.json" if path.is_dir() else path
    try:
        content = json.loads(file.read_text(encoding="utf-8"), parse_constant=_refuse_constant)
    except OSError as error:
        reason = (error.strerror or "unreadable").lower()
        raise SpecificationError(
            f"{path} must be a readable report.json or a folder that holds one, not: {reason}"
        ) from error
    except (ValueError, RecursionError) as error:  # no JSON, or lists some thousand deep
        raise SpecificationError(f"{file} must be a report.json of sosmith, not text that is no JSON") from error
    problem = _problem(content)
    if problem:
        raise SpecificationError(f"{file} must be a report.json of sosmith, not JSON {problem}")
    report: dict[str, Any] = content
    return report


def _refuse_constant(name: str) -> float:
    """Refuse NaN and infinity, which Python's reader takes and JSON does not have."""
    raise ValueError(name)


def _problem(content: Any) -> str:
    """Say, to follow "JSON", what keeps `content` from being a report; empty if nothing does."""
    for keys, types in _REQUIRED.items():
        value = content
        for key in keys:
            if not isinstance(value, dict) or key not in value:
                return f"without {'.'.join(keys)}"
            value = value[key]
        # bool is a kind of int in Python, not in JSON
        if not isinstance(value, types) or (isinstance(value, bool) and bool not in types):
            return f"with {shortened(value)} as {'.'.join(keys)}"
        # half of a surrogate pair cannot be printed, and a line break would break the table
        if isinstance(value, str) and not value.isprintable():
            return f"with {shortened(value)} as {'.'.join(keys)}"
        # no float holds such a number, and 1e999 is read as infinity
        if isinstance(value, _NUMBER) and not abs(value) <= sys.float_info.max:
            return f"with a number out of range as {'.'.join(keys)}"
    return ""


def _get(report: Report, key: str) -> Any:
    value: Any = report
    for part in key.split("."):
        value = value[part]
    return value


def _row(
    reports: Sequence[Report],
    key: str,
    title: str,
    show: Callable[[Any, str], str],
    better: Callable[[Sequence[float]], float] | None = None,
) -> Row:
    """Row of the property `key`; `show` takes value and unit, `better` picks the best (`min` or `max`)."""
    values = tuple(_get(report, key) for report in reports)
    units = [report["error"]["unit"] for report in reports]
    cells = tuple("—" if value is None else show(value, unit) for value, unit in zip(values, units, strict=True))
    best: tuple[int, ...] = ()
    known = [value for value in values if value is not None]
    if better is not None and known and len(set(units)) == 1:
        # equal to the eye is equal: differences below the digits shown do not make a winner
        winner = cells[values.index(better(known))]
        best = tuple(index for index, cell in enumerate(cells) if cell == winner)
    if len(best) == len(known):
        best = ()
    return Row(key=key, title=title, values=values, cells=cells, best=best)


def _percent(value: float, _unit: str) -> str:
    return f"{value:.4f} %".replace("-", "−")


def compare(reports: Sequence[Report]) -> list[Row]:
    """Line up reports as `load_report` returns them, or as `sosmith.gen.report.report.summarise` makes them.

    Raises
    ------
    ValueError
        If there is no report.
    """
    if not reports:
        raise ValueError("reports must hold at least one report, not none")

    def row(key: str, title: str, show: Callable[[Any, str], str], better: Any = None) -> Row:
        return _row(reports, key, title, show, better)

    return [
        row("name", "name", lambda value, _: str(value)),
        row("realization", "realization", lambda value, _: str(value)),
        row("simulator", "simulator", lambda value, _: str(value)),
        row("samples", "samples", lambda value, _: f"{value:,}"),
        row("passed", "verdict", lambda value, _: "passed" if value else "falls short"),
        row("bit_exact", "equal to the integer model", lambda value, _: "bit for bit" if value else "no"),
        row("error.max_abs", "largest error", quantity, min),
        row("error.max_lsb", "largest error in LSB", lambda value, _: f"{plain_number(value)} LSB", min),
        row("error.rms", "typical error (RMS)", quantity, min),
        row("error.bound", "error limit", quantity, min),
        row("sqnr_db", "signal to error", lambda value, _: decibels(value), max),
        row("accuracy_percent.hardware", "accuracy, hardware", _percent, max),
        row("accuracy_percent.golden", "accuracy, exact calculation", _percent),
        row("accuracy_percent.unfiltered", "accuracy without the filter", _percent),
        row("cycles_per_sample", "clock cycles per sample", lambda value, _: plain_number(value), min),
    ]


def comparison_json(reports: Sequence[Report]) -> dict[str, Any]:
    """Comparison as plain data: ``{"names": [...], "rows": [{"key", "title", "values", "best"}]}``."""
    rows = compare(reports)
    return {
        "names": column_names(reports),
        "rows": [
            {"key": row.key, "title": row.title, "values": list(row.values), "best": list(row.best)} for row in rows
        ],
    }


def column_names(reports: Sequence[Report]) -> list[str]:
    """Names of the reports; those that share a name get its realization, and a number if that is not enough."""
    names = [str(report["name"]) for report in reports]
    if len(set(names)) < len(names):
        names = [f"{report['name']}, {report['realization']}" for report in reports]
    return [
        f"{name} ({names[: index + 1].count(name)})" if names.count(name) > 1 else name
        for index, name in enumerate(names)
    ]


def _ranking(reports: Sequence[Report]) -> Figure | None:
    """Figure of the largest errors, or None where units differ."""
    units = {report["error"]["unit"] for report in reports}
    if len(units) > 1 or len(reports) < 2:
        return None
    rows = [
        (name, float(report["error"]["max_abs"]), "hardware" if report["passed"] else "limit")
        for name, report in zip(column_names(reports), reports, strict=True)
    ]
    unit = units.pop()
    return Figure(
        drawing=ranking_figure(rows, [], unit, WIDE),
        narrow=ranking_figure(rows, [], unit, NARROW),
        caption="Blue passed, orange falls short. Mind the scale: each grid line is a step by the same factor.",
    )


def comparison_page(reports: Sequence[Report]) -> str:
    """One HTML page that stands alone, with all reports side by side."""
    return render(
        "sosmith.gen.report",
        "comparison.html.jinja",
        names=column_names(reports),
        passed=sum(bool(report["passed"]) for report in reports),
        rows=compare(reports),
        ranking=_ranking(reports),
    )
