"""The edge of the house: commands at boards that lie. Writes its counts to docs/assurance.md.

python -m benchmarks.edge --runs 1000      run, and record
python -m benchmarks.edge --check          run a share, status 1 if there is a finding
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from tests.edge.hostile_run import Outcome, hostile_run

DOCUMENT = Path(__file__).resolve().parent.parent / "docs" / "assurance.md"
_PART = re.compile(r"<!-- edge -->\n.*?<!-- end of edge -->", re.DOTALL)
_FIRST = 1_000_000
"""First seed, beyond those of the tests."""
_CHECKED = 50


def table(outcomes: Sequence[Outcome]) -> str:
    """Return the counts as a table in Markdown."""
    statuses = Counter(each.status for each in outcomes)
    rows = {
        "runs of `monitor` and `stream` at a board that lies": len(outcomes),
        "messages of these boards": sum(each.messages for each in outcomes),
        "lies among them, false identities included": sum(each.lies for each in outcomes),
        **{f"runs that ended with status {status}": statuses[status] for status in sorted(statuses)},
        "findings": sum(len(each.findings) for each in outcomes),
    }
    return "| | count |\n|---|---:|\n" + "".join(f"| {what} | {count:,} |\n" for what, count in rows.items())


def main() -> None:
    """Run what the arguments ask for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=1000, help="runs, each with a seed of its own")
    parser.add_argument("--check", action="store_true", help=f"{_CHECKED} runs, without a record")
    asked = parser.parse_args()
    outcomes = []
    for seed in range(_FIRST, _FIRST + (_CHECKED if asked.check else asked.runs)):
        with tempfile.TemporaryDirectory() as folder:
            outcomes.append(hostile_run(seed, Path(folder)))
        for finding in outcomes[-1].findings:
            print(f"seed {seed}: {finding}", file=sys.stderr)
    counts = table(outcomes)
    print(counts, end="")
    if not asked.check:
        text = DOCUMENT.read_text(encoding="utf-8")
        part = f"<!-- edge -->\n{counts}<!-- end of edge -->"
        DOCUMENT.write_text(_PART.sub(lambda _: part, text), encoding="utf-8")
    sys.exit(any(each.findings for each in outcomes))


if __name__ == "__main__":
    main()
