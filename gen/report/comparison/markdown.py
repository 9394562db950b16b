"""A comparison as GitHub-flavoured Markdown, for the summary of a workflow or a pull request."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from sosmith.gen.report.comparison.baseline import Judgement
from sosmith.gen.report.comparison.choice import choose
from sosmith.gen.report.comparison.differences import differences
from sosmith.gen.report.comparison.fairness import fairness
from sosmith.gen.report.comparison.report_file import Report
from sosmith.gen.report.comparison.rows import column_names, compare

_MARKS = {"better": "🟢 better", "equal": "⚪ equal", "within": "⚪ within", "worse": "🔴 worse"}


def comparison_markdown(reports: Sequence[Report], judgements: Sequence[Judgement] = ()) -> str:
    """Comparison as Markdown; with `judgements`, of which the baseline is the first report, they come first."""
    names = column_names(reports, baseline=bool(judgements))
    parts = [_judgement(one) for one in judgements]
    if not judgements:
        choice = choose(reports, names)
        parts.append(f"## Accuracy reports side by side\n\n{_escaped(choice.reason)}\n")
    different = differences(reports)
    if different:
        rows = [(one.group, one.title, *one.cells) for one in different]
        parts.append("### What differs\n\n" + _table(("", "", *names), rows))
    unfair = dict.fromkeys(reason for reason in vars(fairness(reports)).values() if reason)
    parts += [f"> No winner everywhere: {_escaped(reason)}\n" for reason in unfair]
    figures = [
        (row.title, *(f"{cell} ★" if k in row.best else cell for k, cell in enumerate(row.cells)))
        for row in compare(reports)
        if row.key != "name"
    ]
    table = _table(("", *names), figures)
    parts.append(f"<details><summary>All figures</summary>\n\n{table}\n</details>\n")
    return "\n".join(parts)


def _judgement(one: Judgement) -> str:
    verdict = "✅" if one.passed else "❌"
    words = "is not worse than" if one.passed else "falls short beside"
    lines = [f"## {verdict} {_escaped(one.name)} {words} the baseline\n"]
    lines += [f"- {_escaped(reason)}" for reason in one.reasons]
    if one.reasons:
        lines.append("")
    rows = [
        (
            each.title,
            *each.cells,
            each.change,
            f"{each.tolerance.text()} allowed",
            _MARKS.get(each.verdict, "🔴 not comparable"),
        )
        for each in one.judged
    ]
    return "\n".join(lines) + "\n" + _table(("figure", "baseline", "candidate", "change", "tolerance", "verdict"), rows)


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    cells = list(head)
    lines = [cells, ["---"] * len(cells), *rows]
    return "".join(f"| {' | '.join(cell if cell == '---' else _escaped(cell) for cell in line)} |\n" for line in lines)


def _escaped(text: str) -> str:
    """Text that GitHub shows as it is."""
    return re.sub(r"([\\`*_{}\[\]()#+!|~<>&@-])", lambda match: _entity(match[0]), text)


def _entity(sign: str) -> str:
    """Signs that begin tags, mentions or references become entities, the others get a backslash."""
    entities = {"<": "&lt;", ">": "&gt;", "&": "&amp;", "@": "&#64;"}
    if sign in "-()+!":  # harmless inside a line
        return sign
    return entities.get(sign, f"\\{sign}")
