"""The page of a qualification: each requirement with what became of its tests."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
from benchmarks.qualification.requirements import Requirement

_PAGE = Path(__file__).with_name("page.html.jinja")


def page(
    requirements: Sequence[Requirement],
    outcomes: bytes,
    *,
    about: Mapping[str, str],
    digests: Mapping[str, str],
    date: str,
    slow: bool,
) -> tuple[str, bool]:
    """Return the page, and whether every requirement is shown.

    Parameters
    ----------
    requirements : sequence of Requirement
        What has to hold.
    outcomes : bytes
        What became of each test, as the plugin writes it.
    about, digests : mapping of str to str
        Machine and programs, and the digests of what was qualified, by name.
    date : str
        When it was done.
    slow : bool
        Whether the long sweeps ran.
    """
    lines: list[dict[str, Any]] = [json.loads(line) for line in outcomes.splitlines()]
    rows = [_row(one, lines) for one in requirements]
    count = Counter(line["outcome"] for line in lines)
    context = {
        "about": about,
        "digests": digests,
        "date": date,
        "slow": slow,
        "rows": rows,
        "lacking": [row["id"] for row in rows if row["verdict"] == "not run"],
        "total": len(lines),
        **{name: count[name] for name in ("passed", "failed", "skipped")},
        "digest": hashlib.sha256(outcomes).hexdigest(),
        "failures": sorted(line["test"] for line in lines if line["outcome"] == "failed"),
        "reasons": sorted(Counter(line["reason"] for line in lines if line["outcome"] == "skipped").items()),
    }
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, keep_trailing_newline=True)
    text = environment.from_string(_PAGE.read_text(encoding="utf-8")).render(context)
    return text, all(row["verdict"] == "shown" for row in rows) and not count["failed"]


def _row(one: Requirement, lines: Sequence[dict[str, Any]]) -> dict[str, Any]:
    count = Counter(line["outcome"] for line in lines if one.shown_by(line["test"]))
    verdict = "failed" if count["failed"] else "shown" if count["passed"] else "not run"
    kinds = {name: count[name] for name in ("passed", "failed", "skipped")}
    return {"id": one.id, "claim": one.claim, "text": one.text, "verdict": verdict, **kinds}
