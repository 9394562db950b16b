"""The record of the last run as tables, and what in it still needs a test or a reason."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.mutation.campaign import share
from benchmarks.mutation.exempt import RULES
from benchmarks.mutation.rooms import ROOMS

RECORD = Path(__file__).with_name("record.json")

COUNTED = ("mutants", "sites", "sampled", "killed", "timed_out", "survived", "equivalent")


def table(record: dict[str, Any]) -> list[list[str]]:
    """Return the rows of the table, the sum last: name, the figures of `COUNTED`, share killed in per cent."""
    rooms = record["rooms"]
    total = {name: sum(entry[name] for entry in rooms.values()) for name in COUNTED}
    return [
        [name, *(f"{entry[key]:,}" for key in COUNTED), f"{100 * share(entry):.1f} %"]
        for name, entry in [*rooms.items(), ("all", total)]
    ]


def heads() -> list[str]:
    """Return the heads of the table's columns."""
    return ["room", *(name.replace("_", " ") for name in COUNTED), "killed of the others"]


def markdown(record: dict[str, Any]) -> str:
    """Return the record as Markdown: the table, what was left out, and every survivor with its reason."""
    rooms = record["rooms"]
    lines = [f"| {' | '.join(heads())} |", "|---|" + "---:|" * (len(heads()) - 1)]
    lines += [f"| {' | '.join(row)} |" for row in table(record)]
    if missing := [name for name in ROOMS if name not in rooms]:
        lines += ["", f"Not tried yet: {', '.join(missing)}."]
    exempt: Counter[str] = Counter()
    for entry in rooms.values():
        exempt.update(entry["exempt"])
    lines += ["", "| left out by rule | mutants |", "|---|---:|"]
    lines += [f"| {RULES[rule]} | {count:,} |" for rule, count in sorted(exempt.items())]
    lines += ["", "| mutant | why no test kills it |", "|---|---|"]
    for entry in rooms.values():
        for trial in entry["sample"]:
            if trial["outcome"] in {"equivalent", "survived"}:
                change = " becomes ".join(
                    f"`{trial[side].replace('|', chr(92) + '|')}`" for side in ("before", "after")
                )
                why = trial.get("reason", "**not known**")
                lines.append(f"| `{trial['path']}`, `{trial['place']}`: {change} | {why} |")
    return "\n".join(lines) + "\n"


def survivors(record: dict[str, Any]) -> Iterator[str]:
    """Yield an entry for the list of equivalent mutants, without its reason, for each survivor that is not listed."""
    for entry in record["rooms"].values():
        for trial in entry["sample"]:
            if trial["outcome"] == "survived":
                names = ("path", "place", "digest", "offset", "before", "after")
                lines = [f"{name} = {json.dumps(trial[name], ensure_ascii=False)}" for name in names]
                yield "\n".join([f"# line {trial['line']}", "[[equivalent]]", *lines, 'reason = ""'])
