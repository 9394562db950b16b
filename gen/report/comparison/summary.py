"""A whole comparison as plain data, for JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from sosmith.gen.report.comparison.baseline import Judgement
from sosmith.gen.report.comparison.choice import choose
from sosmith.gen.report.comparison.differences import differences
from sosmith.gen.report.comparison.fairness import fairness
from sosmith.gen.report.comparison.report_file import Report
from sosmith.gen.report.comparison.rows import column_names, compare


def comparison_json(reports: Sequence[Report], judgements: Sequence[Judgement] = ()) -> dict[str, Any]:
    """Comparison in the types of JSON.

    Returns
    -------
    dict
        ``names``; ``differences`` with ``group``, ``title`` and ``cells`` (texts); ``unfair``: the reason by kind of
        figure, empty where it can be compared; ``rows`` with ``group``, ``key``, ``title``, ``values`` and ``best``
        (indices); ``choice`` with ``taken`` (index or None), ``reason`` and ``beaten``. With `judgements`, of which
        the baseline is the first report, ``baseline`` with ``name``, ``passed`` and ``candidates``.
    """
    names = column_names(reports, baseline=bool(judgements))
    choice = choose(reports, names)
    tree: dict[str, Any] = {
        "names": names,
        "differences": [
            {"group": one.group, "title": one.title, "cells": list(one.cells)} for one in differences(reports)
        ],
        "unfair": asdict(fairness(reports)),
        "rows": [
            {
                "group": row.group,
                "key": row.key,
                "title": row.title,
                "values": list(row.values),
                "best": list(row.best),
            }
            for row in compare(reports)
        ],
        "choice": {"taken": choice.taken, "reason": choice.reason, "beaten": list(choice.beaten)},
    }
    if judgements:
        tree["baseline"] = {
            "name": names[0],
            "passed": all(one.passed for one in judgements),
            "candidates": [_candidate(one) for one in judgements],
        }
    return tree


def _candidate(judgement: Judgement) -> dict[str, Any]:
    return {
        "name": judgement.name,
        "passed": judgement.passed,
        "reasons": judgement.reasons,
        "figures": [
            {
                "figure": one.figure,
                "baseline": one.values[0],
                "candidate": one.values[1],
                "tolerance": one.tolerance.text(),
                "verdict": one.verdict,
                "reason": one.reason,
            }
            for one in judgement.judged
        ],
    }
