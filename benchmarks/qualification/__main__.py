"""The command `./run qualify`; see the package."""

from __future__ import annotations

import argparse
import datetime
import os
import re
import subprocess
import sys
from pathlib import Path

import benchmarks.qualification
from benchmarks.qualification import answers, independence
from benchmarks.qualification.dossier import page
from benchmarks.qualification.made_here import bill, example
from benchmarks.qualification.outcomes import FILE
from benchmarks.qualification.requirements import ROOT, requirements, tables
from benchmarks.qualification.surroundings import digests, surroundings

DOCUMENT = ROOT / "docs" / "assurance.md"


def documented(text: str) -> str:
    """Return the document with the tables as they are."""
    for mark, table in (tables() | {"independence": independence.table()}).items():
        block = re.compile(rf"(?<=<!-- {mark} -->\n).*?(?=<!-- end of {mark} -->)", re.DOTALL)
        assert len(block.findall(text)) == 1, f"{DOCUMENT} must have one block {mark}"
        text = block.sub(lambda _, table=table: table, text)  # type: ignore[misc]
    return text


def main() -> None:
    """Do what the arguments ask for; status 1 if a requirement is not shown."""
    parser = argparse.ArgumentParser(
        prog="./run qualify",
        description=benchmarks.qualification.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--slow", action="store_true", help="run the long sweeps as well")
    parser.add_argument("--document", action="store_true", help="only write the tables of docs/assurance.md")
    parser.add_argument(
        "-o", "--output", type=Path, default=ROOT / "build" / "qualification", help="folder of the page"
    )
    parser.add_argument("only", nargs="*", help="requirements, such as R04; all by default")
    asked = parser.parse_args()
    if asked.document:
        DOCUMENT.write_text(documented(DOCUMENT.read_text(encoding="utf-8")), encoding="utf-8")
        return
    chosen = [one for one in requirements() if not asked.only or one.id in asked.only]
    if unknown := {*asked.only} - {one.id for one in chosen}:
        parser.error(f"requirements must be among {', '.join(one.id for one in requirements())}, not {unknown.pop()}")
    asked.output.mkdir(parents=True, exist_ok=True)
    outcomes = asked.output.absolute() / "outcomes.jsonl"
    outcomes.write_bytes(b"")
    status = _run(sorted({test for one in chosen for test in one.tests}), outcomes, slow=asked.slow)
    text, shown = page(
        chosen,
        outcomes.read_bytes(),
        about=surroundings(),
        digests=digests(),
        date=datetime.date.today().isoformat(),
        slow=asked.slow,
    )
    (asked.output / "qualification.html").write_text(text, encoding="utf-8")
    missing = answers.write(asked.output, outcomes.read_bytes(), about=surroundings(), example=example, bill=bill)
    print(asked.output / "qualification.html")
    print(asked.output / "answers.csv")
    for line in missing:
        print(f"not answered: section {line.section}, {line.text}")
    sys.exit(130 if status == _INTERRUPTED else 0 if shown and not status and not missing else 1)


_INTERRUPTED = 2
"""The status of pytest after Ctrl-C."""


def _run(tests: list[str], outcomes: Path, *, slow: bool) -> int:
    """Run tests, with what they print, and write what became of each."""
    line = [sys.executable, "-m", "pytest", "-n", "auto", "--dist", "worksteal"]
    line += ["-p", "benchmarks.qualification.outcomes", "-m", "" if slow else "not slow", *tests]
    return subprocess.run(line, cwd=ROOT, env={**os.environ, FILE: str(outcomes)}, check=False).returncode


if __name__ == "__main__":
    main()
