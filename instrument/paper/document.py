"""The document that compares our figures with the paper's, as Markdown with pictures and as JSON."""

from __future__ import annotations

from typing import Any

from sosmith.instrument.paper.accuracy import filtered_part, stated_part, unfiltered_parts
from sosmith.instrument.paper.comparison import (
    DIFFERS,
    LABELS,
    LAST_DIGIT_PART,
    NEAR,
    NEAR_PART,
    NOT_COMPARABLE,
    NOT_PRINTED,
    REPRODUCED,
    Comparison,
    Part,
    table,
)
from sosmith.instrument.paper.difference_equation import difference_equation_parts
from sosmith.instrument.paper.fifth_order import fifth_order_parts
from sosmith.instrument.paper.figures import PaperFigures
from sosmith.instrument.paper.plots import plots
from sosmith.instrument.paper.regression import regression_parts
from sosmith.instrument.paper.seventh_order import seventh_order_parts
from sosmith.instrument.paper.vehicle import vehicle_parts
from sosmith.instrument.paper.wear import wear_part

_CHAPTERS = (
    "Calibration",
    "Accuracy",
    "The 5th-order filter",
    "The vehicle",
    "The 7th-order filter",
    "Wear and conclusions",
)

_HEAD = """# The paper beside its tables

Written by `sosmith paper`; nothing here is typed in. The paper is C. Nkundineza, J. N. Njaji, S. Abubeker, O. Gatera
and D. Hanyurwimfura, *Advancing rail safety: An onboard measurement system of rolling stock wheel flange wear based on
dynamic machine learning algorithms*. Each of its equations and tables with figures is computed again here, from what
the paper itself states, and set beside the printed figure."""


def paper_parts(figures: PaperFigures) -> dict[str, list[Part]]:
    """Equations and tables by chapter, in the order of the paper."""
    parts = [
        regression_parts(figures),
        unfiltered_parts(figures),
        [*fifth_order_parts(figures), filtered_part(figures)],
        vehicle_parts(figures),
        [*seventh_order_parts(figures), *difference_equation_parts(figures)],
        [wear_part(figures), stated_part(figures)],
    ]
    return dict(zip(_CHAPTERS, parts, strict=True))


def paper_files(figures: PaperFigures) -> dict[str, str]:
    """Texts of ``paper.md`` and, in ``images/``, its pictures, by path."""
    return {"paper.md": markdown(figures), **{f"images/{name}": text for name, text in plots(figures).items()}}


def markdown(figures: PaperFigures) -> str:
    """Return the document."""
    chapters = paper_parts(figures)
    blocks = [_HEAD, *_rule(), "## Summary", *_summary(chapters)]
    for title, parts in chapters.items():
        blocks.append(f"## {title}")
        for part in parts:
            blocks += [f"### {part.title}", f"*{_sentence(part.where)}* {_sentence(part.finding)}", *part.before]
            blocks += [_comparison_table(part.comparisons)] if part.comparisons else []
            blocks += part.after
    return "\n\n".join(blocks) + "\n"


def paper_json(figures: PaperFigures) -> list[dict[str, Any]]:
    """All comparisons by equation and table; numbers as strings, which keep their digits."""
    return [
        {
            "title": part.title,
            "where": part.where,
            "finding": part.finding,
            "comparisons": [
                {
                    "quantity": one.quantity,
                    "unit": one.unit,
                    "printed": None if one.printed is None else one.shown_printed,
                    "ours": None if one.ours is None else one.shown,
                    "label": one.label,
                    "explanation": one.explanation,
                }
                for one in part.comparisons
            ],
        }
        for parts in paper_parts(figures).values()
        for part in parts
    ]


def summary_rows(figures: PaperFigures) -> list[list[str]]:
    """For each equation and table: title, number of figures with each of `LABELS`, finding."""
    return [row for parts in paper_parts(figures).values() for row in map(_summary_row, parts)]


def _rule() -> list[str]:
    meanings = {
        REPRODUCED: "ours, rounded to the printed digits, is the printed figure; or it is one off in the last digit, "
        f"where that is worth no more than {100 * LAST_DIGIT_PART:.0f} % of it",
        NEAR: f"within {100 * NEAR_PART:.0f} % of the printed figure",
        DIFFERS: "farther off; the note says why",
        NOT_COMPARABLE: "there is nothing to compare with, or the two are not the same thing; the note says why",
        NOT_PRINTED: "ours alone",
    }
    accuracies = (
        "For accuracies these are parts of what is missing to 100 %: 98 % is not near to 97 %. A figure that the "
        "paper lets one compute in two ways is compared twice."
    )
    return ["\n".join(f"- **{label}**: {meaning}." for label, meaning in meanings.items()), accuracies]


def _summary(chapters: dict[str, list[Part]]) -> list[str]:
    parts = [part for group in chapters.values() for part in group]
    counts = {label: sum(part.count(label) for part in parts) for label in LABELS}
    total = ", ".join(f"{label} {count}" for label, count in counts.items())
    return [
        f"Of {sum(counts.values())} comparisons: {total}.",
        table(["", *LABELS, "what came out"], map(_summary_row, parts)),
    ]


def _summary_row(part: Part) -> list[str]:
    return [part.title, *(str(part.count(label) or "") for label in LABELS), part.finding]


def _comparison_table(comparisons: tuple[Comparison, ...]) -> str:
    rows = [[one.quantity, one.shown_printed, one.shown, one.unit, one.label, one.explanation] for one in comparisons]
    return table(["", "printed", "ours", "unit", "", "note"], _without_repeated_notes(rows))


def _without_repeated_notes(rows: list[list[str]]) -> list[list[str]]:
    """Write a note shared by consecutive rows only once, with ditto marks below it."""
    result, before = [], ""
    for row in rows:
        note = row[-1]
        result.append([*row[:-1], "〃" if note and note == before else note])
        before = note
    return result


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."
