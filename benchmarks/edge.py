"""The edge of the house: what comes from outside lies. Counts go to benchmarks/edge.json and docs/assurance.md.

python -m benchmarks.edge                  all parts, and record
python -m benchmarks.edge --part kills     one part, and record; see `PARTS`
python -m benchmarks.edge --check          a share of each part without a record, status 1 if there is a finding
python -m benchmarks.edge --document       only write the document from the record
"""

from __future__ import annotations

import argparse
import json
import random
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from tests.edge.hostile_alarms import published
from tests.edge.hostile_board import to_model, to_netlist
from tests.edge.hostile_run import hostile_run
from tests.edge.pages.hostile_page import attacked
from tests.edge.processes import full_disks
from tests.edge.processes.environments import COMMANDS, tried
from tests.edge.processes.kills import duration, killed
from tests.edge.processes.writers import QUICK, WHOLE

ROOT = Path(__file__).resolve().parent.parent
RECORD = ROOT / "benchmarks" / "edge.json"
DOCUMENT = ROOT / "docs" / "assurance.md"
_PART = re.compile(r"<!-- edge -->\n.*?<!-- end of edge -->", re.DOTALL)
_FIRST = 1_000_000
"""First seed, beyond those of the tests."""
_SHARE = 20
"""With `--check`, one in so many."""

Rows = dict[str, int]
"""Counts by what they count; those of findings end with that word."""


def host(share: int) -> Rows:
    """Let `monitor` and `stream` meet boards that lie."""
    outcomes = []
    for seed in range(_FIRST, _FIRST + 110 // share):
        with tempfile.TemporaryDirectory() as folder:
            outcomes.append(hostile_run(seed, Path(folder)))
        _tell(f"seed {seed}", outcomes[-1].findings)
    statuses = Counter(each.status for each in outcomes)
    return {
        "host: runs of `monitor` and `stream` at a board that lies": len(outcomes),
        "host: messages of these boards": sum(each.messages for each in outcomes),
        "host: lies among them, false identities included": sum(each.lies for each in outcomes),
        **{f"host: runs that ended with status {status}": statuses[status] for status in sorted(statuses)},
        "host: findings": sum(len(each.findings) for each in outcomes),
    }


def board(share: int) -> Rows:
    """Send hostile messages to the model of a board, and to its hardware in Verilator."""
    models = [to_model(seed, 300) for seed in range(_FIRST, _FIRST + 48 // share)]
    with tempfile.TemporaryDirectory() as folder:
        hardware = to_netlist(Path(folder), _FIRST, 500 // share)
    findings = [one for each in (*models, hardware) for one in each.findings]
    _tell("board", findings)
    return {
        "board: hostile messages to its model, with and without registers": sum(each.messages for each in models),
        "board: hostile messages to its hardware, in Verilator": hardware.messages,
        "board: findings": len(findings),
    }


def studio(share: int) -> Rows:
    """Say hostile things to the studio."""
    return _page("studio", "studio", share)


def page(share: int) -> Rows:
    """Say hostile things to the page of a monitor."""
    return _page("monitor", "page of `monitor`", share)


def _page(name: str, shown: str, share: int) -> Rows:
    heard = [attacked(name, seed, 1000 // share) for seed in range(_FIRST, _FIRST + 10)]
    findings = [one for each in heard for one in each.findings]
    _tell(name, findings)
    return {
        f"{shown}: hostile requests, frames and messages": sum(each.messages for each in heard),
        f"{shown}: findings": len(findings),
    }


def kills(share: int) -> Rows:
    """Kill all that writes."""
    rows, findings = dict[str, int](), list[str]()
    for name, writer, count in (
        *((name, writer, 160) for name, writer in QUICK.items()),
        *((name, WHOLE[name], {"generate": 20, "explore": 10}.get(name, 4)) for name in WHOLE),
    ):
        longest = duration(writer)
        found = [killed(writer, seed, longest) for seed in range(_FIRST, _FIRST + max(count // share, 1))]
        findings += [f"{name}: {one}" for each in found for one in each.findings]
        rows[f"kills of {name}, while at work"] = sum(each.at_work for each in found)
    _tell("kills", findings)
    return {"kills in all": sum(rows.values()), **rows, "kills: findings": len(findings)}


def environments(share: int) -> Rows:
    """Run commands in hostile environments."""
    found = [tried(seed) for seed in range(_FIRST, _FIRST + 204 // share)]
    findings = [one for each in found for one in each.findings]
    _tell("environments", findings)
    statuses = Counter(each.status for each in found)
    return {
        f"environments, of {len(COMMANDS)} calls of commands": len(found),
        **{f"environments: calls that ended with status {status}": statuses[status] for status in sorted(statuses)},
        "environments: findings": len(findings),
    }


def disks(share: int) -> Rows:
    """Run commands on full disks: once for each path that they write, and each place that may be full."""
    if not full_disks.possible():
        sys.exit("full disks take a file system of their own: run this as a user who may have one (unshare -rm)")
    cases = [(writer, place) for writer in full_disks.WRITERS for place in full_disks.PLACES][::share]
    rng = random.Random(_FIRST)
    found = [full_disks.tried(writer, place, rng.choice(full_disks.SIZES)) for writer, place in cases]
    findings = [
        f"{' '.join(case[0])}, {case[1]}: {one}"
        for case, each in zip(cases, found, strict=True)
        for one in each.findings
    ]
    _tell("disks", findings)
    statuses = Counter(each.status for each in found)
    return {
        f"full disks, for {len(full_disks.WRITERS)} ways of commands to write, temporary files and caches": len(found),
        **{f"full disks: calls that ended with status {status}": statuses[status] for status in sorted(statuses)},
        "full disks: findings": len(findings),
    }


def alarms(share: int) -> Rows:
    """Publish alarms to a broker that is killed again and again."""
    with tempfile.TemporaryDirectory() as folder:
        told = published(Path(folder), 400 // share, random.Random(_FIRST))
    _tell("alarms", told.findings)
    return {
        "alarms: published to a broker that is killed": told.alarms,
        "alarms: kills of the broker": told.kills,
        "alarms: findings": len(told.findings),
    }


PARTS: dict[str, Callable[[int], Rows]] = {
    "host": host,
    "board": board,
    "studio": studio,
    "page": page,
    "kills": kills,
    "environments": environments,
    "disks": disks,
    "alarms": alarms,
}


def _tell(where: str, findings: list[str] | tuple[str, ...]) -> None:
    for finding in findings:
        print(f"{where}: {finding}", file=sys.stderr)


def table(recorded: dict[str, Rows]) -> str:
    """Return the counts as a table in Markdown."""
    rows = {what: count for part in PARTS for what, count in recorded.get(part, {}).items()}
    return "| | count |\n|---|---:|\n" + "".join(f"| {what} | {count:,} |\n" for what, count in rows.items())


def main() -> None:
    """Run what the arguments ask for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", choices=PARTS, action="append", help="this part only; may be given several times")
    parser.add_argument("--check", action="store_true", help=f"one in {_SHARE}, without a record")
    parser.add_argument("--document", action="store_true", help="only write the document from the record")
    asked = parser.parse_args()
    made = {} if asked.document else {part: PARTS[part](_SHARE if asked.check else 1) for part in asked.part or PARTS}
    if asked.check:
        recorded = made
    else:
        recorded = json.loads(RECORD.read_text(encoding="utf-8")) | made
        RECORD.write_text(json.dumps(recorded, indent=2) + "\n", encoding="utf-8")
        part = f"<!-- edge -->\n{table(recorded)}<!-- end of edge -->"
        text = DOCUMENT.read_text(encoding="utf-8")
        DOCUMENT.write_text(_PART.sub(lambda _: part, text), encoding="utf-8")
    print(table(recorded), end="")
    sys.exit(any(count for rows in recorded.values() for what, count in rows.items() if what.endswith("findings")))


if __name__ == "__main__":
    main()
