"""docs/speed.md, of which every benchmark of speed writes its own section, and what these benchmarks have in common."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

ROOT = Path(__file__).resolve().parent.parent
DOCUMENT = ROOT / "docs" / "speed.md"

Row = TypeVar("Row")


@dataclass(frozen=True, kw_only=True)
class Benchmark(Generic[Row]):
    """A benchmark with a record, ``benchmarks/<name>.json``, and a section of the document.

    Attributes
    ----------
    name : str
        Its name, that of its module.
    row : callable
        Makes a row of the table from its attributes as recorded.
    measure : callable
        Measures all rows; takes the number of runs, of which the fastest counts.
    section : callable
        Writes the section of the document.
    tables : callable
        Writes the tables alone, to be printed.
    losses : callable
        Says, given rows recorded and rows measured, what has become slower than it may.
    """

    name: str
    row: Callable[..., Row]
    measure: Callable[[int], list[Row]]
    section: Callable[[list[Row]], str]
    tables: Callable[[list[Row]], str]
    losses: Callable[[list[Row], list[Row]], list[str]]

    @property
    def record(self) -> Path:
        """File with the recorded figures."""
        return ROOT / "benchmarks" / f"{self.name}.json"

    def recorded(self) -> list[Row]:
        """Read the recorded figures."""
        return [self.row(**row) for row in json.loads(self.record.read_text(encoding="utf-8"))]

    def main(self, description: str | None, *, repeats: int, arguments: Sequence[str] | None = None) -> None:
        """Measure and write, or check: the command, with `repeats` as the default number of runs."""
        parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
        parser.add_argument("--repeats", type=int, default=repeats, help="runs, of which the fastest counts")
        parser.add_argument("--check", action="store_true", help="write nothing, and fail if it has become slower")
        parser.add_argument("--document", action="store_true", help="only write the document from the record")
        options = parser.parse_args(arguments)
        rows = self.recorded() if options.document else self.measure(options.repeats)
        print(self.tables(rows), end="")
        if options.check:
            if faults := self.losses(self.recorded(), rows):
                sys.exit("\n".join(faults))
            return
        if not options.document:
            recorded: list[Any] = [asdict(row) for row in rows]  # type: ignore[call-overload]
            self.record.write_text(json.dumps(recorded, indent=2) + "\n", encoding="utf-8")
        renew(self.name, self.section(rows))


def shown(name: str) -> str:
    """Return the section of a benchmark, as it stands in the document."""
    return _parts(name)[1]


def renew(name: str, text: str) -> None:
    """Write the section of a benchmark anew."""
    before, _, after = _parts(name)
    DOCUMENT.write_text(f"{before}{text}{after}", encoding="utf-8")


def _parts(name: str) -> tuple[str, str, str]:
    """Split the document into what is before a section, the section, and what is after it."""
    before, begin, rest = DOCUMENT.read_text(encoding="utf-8").partition(f"<!-- {name} -->\n")
    section, end, after = rest.partition(f"<!-- end of {name} -->")
    if not (begin and end):
        raise ValueError(f"{DOCUMENT} must have a section {name}")
    return before + begin, section, end + after
