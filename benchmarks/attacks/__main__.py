"""Attacks `sosmith verify` with wrong texts and certificates: `python -m benchmarks.attacks`.

Every text that is accepted is simulated in Icarus, Verilator and, through its own netlist, Yosys, beside the right one.
The counts go to benchmarks/attacks/record.json and into the table of docs/assurance.md; `--check` runs a share and
writes nothing.
The seeds are fixed. Status 1 if a text is accepted that a tool sees otherwise, a certificate that claims more, or if
anything ends in a traceback or takes more than a minute.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import re
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from benchmarks.attacks.campaign import Outcome, attacked, kinds

ROOT = Path(__file__).resolve().parent.parent.parent
RECORD = Path(__file__).with_name("record.json")
DOCUMENT = ROOT / "docs" / "assurance.md"
TEXTS, CERTIFICATES = 10_000, 5_000
PART = re.compile(r"(?<=<!-- attacks -->\n).*?(?=<!-- end of attacks -->)", re.DOTALL)
_ROWS = {
    "texts": "wrong texts of cores of every architecture",
    "texts, refused by the reader": "refused by the reader",
    "texts, refused by the proof": "read, and refused by the proof",
    "texts, read and not proven": "read, of an architecture that is said not to be proven",
    "texts, accepted": "accepted: the same core in another layout, order or naming",
    "texts, read by the second reader too": "of those read and not accepted, read alike by Yosys, bit by bit",
    "traces, icarus": "accepted texts simulated in Icarus, with the trace of the right one",
    "traces, verilator": "the same in Verilator",
    "traces, yosys": "the same of Yosys' netlist",
    "certificates": "wrong certificates, all digests right",
    "certificates, refused": "refused",
    "certificates, accepted": "accepted",
}


def table(record: dict[str, Any]) -> str:
    """Return the counts as a table in Markdown, and each finding below it."""
    lines = ["| | count |", "|---|---:|"]
    lines += [f"| {words} | {record['counts'].get(key, 0):,} |" for key, words in _ROWS.items()]
    wrong = "findings: a tool sees something else, a claim is another one, a traceback, more than a minute"
    lines.append(f"| {wrong} | {len(record['findings'])} |")
    lines.append(f"| slowest verdict | {record['slowest']:.0f} s |")
    lines += ["", *(f"- {finding}" for finding in record["findings"])] if record["findings"] else []
    return "".join(f"{line}\n" for line in lines)


def share(total: int, number: int, count: int) -> int:
    """Return how many of a total are those of a core."""
    return total * (number + 1) // count - total * number // count


def _task(task: tuple[str, int, int, Path | None]) -> Outcome:
    kind, texts, certificates, keep = task
    kept = None if keep is None else keep / f"{re.sub(r'[^a-z0-9]+', '_', kind)}.json"
    if kept is not None and kept.exists():
        found = json.loads(kept.read_text(encoding="utf-8"))
        return Outcome(Counter(found["counts"]), Counter(found["classes"]), found["findings"], found["slowest"])
    outcome = attacked(kind, texts, certificates)
    if kept is not None:
        kept.write_text(json.dumps(outcome.tree()), encoding="utf-8")
    return outcome


def campaign(texts: int, certificates: int, jobs: int, keep: Path | None = None) -> dict[str, Any]:
    """Attack all cores; return the record."""
    names = kinds()
    tasks = [
        (kind, share(texts, number, len(names)), share(certificates, number, len(names)), keep)
        for number, kind in enumerate(names)
    ]
    total = Outcome()
    with multiprocessing.Pool(jobs) as pool:
        for outcome in pool.imap(_task, tasks, chunksize=1):
            total.add(outcome)
            for finding in outcome.findings:
                print(finding, file=sys.stderr, flush=True)
    return total.tree()


def main() -> None:
    """Run what the arguments ask for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.attacks", description=__doc__)
    parser.add_argument("--check", action="store_true", help="a share of a twentieth, without a record")
    parser.add_argument("--texts", type=int, default=TEXTS, help="wrong texts")
    parser.add_argument("--certificates", type=int, default=CERTIFICATES, help="wrong certificates")
    parser.add_argument("--jobs", type=int, default=2, help="cores that are attacked at a time")
    parser.add_argument("--keep", type=Path, help="folder for what each core gave: an interrupted campaign goes on")
    asked = parser.parse_args()
    if asked.keep is not None:
        asked.keep.mkdir(parents=True, exist_ok=True)
    part = 20 if asked.check else 1
    record = campaign(asked.texts // part, asked.certificates // part, asked.jobs, asked.keep)
    print(table(record), end="")
    if not asked.check:
        RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
        text = DOCUMENT.read_text(encoding="utf-8")
        DOCUMENT.write_text(PART.sub(lambda _: table(record), text), encoding="utf-8")
    sys.exit(bool(record["findings"]))


if __name__ == "__main__":
    main()
