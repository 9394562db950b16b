"""What differs among reports: keys of the specification, trace, datapath, tools."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from reprlib import Repr
from typing import Any

from sosmith.gen.report.comparison.report_file import Report, fact

_DEPTH = 3
"""Tables of a specification lie at most so deep."""

_DIGITS = 12
"""Hexadecimal digits of a digest that are shown."""

UNKNOWN = "—"
MISSING = "not set"

_SHORT = Repr()
_SHORT.maxstring = _SHORT.maxother = 60
_SHORT.maxlist = 8


@dataclass(frozen=True, kw_only=True)
class Difference:
    """One thing that is not the same in all reports.

    Attributes
    ----------
    group : str
        "specification", "trace", "datapath" or "tools".
    title : str
        Key of the specification with dots, or the name for people.
    cells : tuple of str
        Its value in each report.
    """

    group: str
    title: str
    cells: tuple[str, ...]


def differences(reports: Sequence[Report]) -> list[Difference]:
    """List what differs, in the order of the groups; the order within the specification is that of the first report."""
    return [
        *_specification(reports),
        *_facts(reports, "trace", {"trace": "scenario", "input codes, SHA-256": "provenance.trace_sha256"}),
        *_facts(reports, "trace", {"samples": "samples", "seed": "seed"}),
        *_facts(
            reports,
            "datapath",
            {
                "realization": "realization",
                "architecture": "architecture",
                "arithmetic, SHA-256": "provenance.datapath_sha256",
                "netlist for": "gates",
            },
        ),
        *_tools(reports),
    ]


def alike(reports: Sequence[Report]) -> list[tuple[str, str]]:
    """Name and value of what identifies a run and is the same in all reports."""
    titles = {
        "specification, SHA-256": "provenance.specification_sha256",
        "trace": "scenario",
        "input codes, SHA-256": "provenance.trace_sha256",
        "samples": "samples",
        "realization": "realization",
        "architecture": "architecture",
        "simulator": "simulator",
        "sosmith": "sosmith_version",
    }
    values = {title: {_text(fact(report, key)) for report in reports} for title, key in titles.items()}
    return [(title, next(iter(texts))) for title, texts in values.items() if len(texts) == 1 and texts != {UNKNOWN}]


def _specification(reports: Sequence[Report]) -> list[Difference]:
    trees = [fact(report, "provenance.specification") for report in reports]
    if any(tree is None for tree in trees):
        return []
    flat = [flat_keys(tree) for tree in trees]
    keys = dict.fromkeys(key for one in flat for key in one)
    rows = {key: tuple(one.get(key, MISSING) for one in flat) for key in keys}
    return [
        Difference(group="specification", title=key, cells=cells) for key, cells in rows.items() if len(set(cells)) > 1
    ]


def flat_keys(tree: Mapping[str, Any], depth: int = _DEPTH) -> dict[str, str]:
    """Keys with dots, and their values as text; of a list of tables that have names, each by its own."""
    flat: dict[str, str] = {}
    for name, given in tree.items():
        key, value = json.dumps(name)[1:-1], given
        if _are_named(given):
            value = {table["name"]: {k: v for k, v in table.items() if k != "name"} for table in given}
        if isinstance(value, Mapping) and depth > 1:
            flat |= {f"{key}.{inner}": text for inner, text in flat_keys(value, depth - 1).items()}
        else:
            flat[key] = _text(value)
    return flat


def _are_named(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(t, Mapping) and isinstance(t.get("name"), str) for t in value)


def _facts(reports: Sequence[Report], group: str, titles: Mapping[str, str]) -> list[Difference]:
    rows = {title: tuple(_text(fact(report, key)) for report in reports) for title, key in titles.items()}
    return [Difference(group=group, title=title, cells=cells) for title, cells in rows.items() if len(set(cells)) > 1]


def _tools(reports: Sequence[Report]) -> list[Difference]:
    rows = _facts(reports, "tools", {"simulator": "simulator", "sosmith": "sosmith_version"})
    tools = [fact(report, "tools") or {} for report in reports]
    for name in sorted({name for each in tools for name in each}):
        cells = tuple(str(each.get(name, UNKNOWN)) for each in tools)
        if len(set(cells)) > 1:
            rows.append(Difference(group="tools", title=name, cells=cells))
    return rows


def _text(value: Any) -> str:
    """Value as text on one line; long lists are cut."""
    if value is None:
        return UNKNOWN
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        digest = len(value) == 64 and set(value) <= set("0123456789abcdef")
        return value[:_DIGITS] if digest else json.dumps(value, ensure_ascii=not value.isprintable())[1:-1]
    if isinstance(value, int):
        return f"{value:,}" if abs(value) < 10**18 else _SHORT.repr(value)
    return _SHORT.repr(value)
