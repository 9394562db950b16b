"""The dossier beside the page: files that answer each line of docs/assurance.md, and `answers.csv`, which says which.

A line is a section, a claim, a row of proofs, tests, requirements and malfunctions, and what section 12 says of the use
as a tool. Rows that tests show are answered by what became of these tests; records, of which a run takes hours, by the
records that stand in the repository; the rest by what is read or made on the machine.
"""

from __future__ import annotations

import csv
import io
import json
import re
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.qualification import independence
from benchmarks.qualification.requirements import ROOT, malfunctions, requirements

EXAMPLES = ("audio_lowpass", "flange_wear_bench", "flange_wear_locomotive")
RECORDS = {
    "5": "benchmarks/upsets.json",
    "6": "benchmarks/mutation/record.json",
    "7": "benchmarks/edge.json",
    "8": "benchmarks/attacks/record.json",
}
"""Records of campaigns, by the sections of the document."""
_COPIES = {
    "assurance.md": "docs/assurance.md",
    "reporting.md": "SECURITY.md",
    "licence.txt": "LICENSE",
    "verdicts.json": "benchmarks/verdicts.json",
    "rocq.json": "benchmarks/rocq.json",
}
BILL = "components.cdx.json"
_SECTION = re.compile(r"^## (\d+)\. (.+)$", re.MULTILINE)
_PARAGRAPH = re.compile(r"^\*\*([A-Z][a-z ]+)\.\*\*", re.MULTILINE)
_TOOL = {
    "Intended use": "assurance.md",
    "Limits": "examples.csv",
    "Access": "requirements/R19.csv",
    "Independence": "independence.md",
    "Known defects": "reporting.md",
    "Components": BILL,
}
_WHOLE = {
    "1": "examples.csv",
    "2": "claims",
    "3": "claims",
    "4": "outcomes.jsonl",
    "9": "surroundings.csv",
    "10": "requirements",
    "11": "malfunctions",
    "12": "examples.csv",
    "13": "outcomes.jsonl",
    "14": "assurance.md",
}


@dataclass(frozen=True)
class Line:
    """A line of the document: the number of its section, what it says, and the file or folder that answers it."""

    section: str
    text: str
    file: str


def lines(document: str) -> list[Line]:
    """Return all lines of the document that are to be answered.

    Raises
    ------
    ValueError
        If nothing is known to answer one.
    """
    return [Line(section, text, _file(section, text)) for section, text in _lines(document)]


def _lines(document: str) -> Iterator[tuple[str, str]]:
    heads = [*_SECTION.finditer(document)]
    for head, end in zip(heads, [*(one.start() for one in heads[1:]), len(document)], strict=True):
        number, body = head[1], document[head.end() : end]
        yield number, head[2]
        if number in {"2", "3", "4", "10", "11"}:
            yield from ((number, row) for row in _rows(body.split("\n### ", maxsplit=1)[0]))
        if number == "12":
            yield from ((number, found[1]) for found in _PARAGRAPH.finditer(body))


def _rows(body: str) -> Iterator[str]:
    for line in body.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("| ") and cells[0] and cells[0] not in {"claim", "malfunction"}:
            yield " | ".join(cells)


def _file(section: str, text: str) -> str:
    claim = re.match(r"C\d", text)
    if section in {"2", "3", "4"} and claim:
        return f"claims/{claim[0]}.csv"
    if section == "4" and text.startswith("the tests themselves"):
        return "records/6.json"
    if section == "10" and (identifier := re.match(r"R\d\d", text)):
        return f"requirements/{identifier[0]}.csv"
    if section == "11":
        for number, one in enumerate(malfunctions(), start=1):
            if text.startswith(one.what):
                return f"malfunctions/M{number:02}.csv"
    if section == "12" and text in _TOOL:
        return _TOOL[text]
    if section in RECORDS:
        return f"records/{section}.json"
    if section in _WHOLE:
        return _WHOLE[section]
    raise ValueError(f"a file must answer the line {text!r} of section {section}")


def write(
    folder: Path,
    outcomes: bytes,
    *,
    about: Mapping[str, str],
    example: Callable[[str, Path], Mapping[str, Any]],
    bill: Callable[[], str],
) -> list[Line]:
    """Write all files of the dossier but the page, and return the lines whose files are not there.

    Parameters
    ----------
    folder : Path
        Where the files go.
    outcomes : bytes
        What became of each test, as the plugin writes it.
    about : mapping of str to str
        Machine and programs.
    example : callable
        Generates an example into a folder and verifies it; returns what `verify --json` says.
    bill : callable
        Returns the bill of materials; raises OSError where it cannot be made.
    """
    told = [json.loads(line) for line in outcomes.splitlines()]
    (folder / "outcomes.jsonl").write_bytes(outcomes)
    for name, place in _COPIES.items():
        shutil.copyfile(ROOT / place, folder / name)
    for section, place in RECORDS.items():
        _put(folder / "records" / f"{section}.json", (ROOT / place).read_text(encoding="utf-8"))
    _put(folder / "independence.md", independence.table())
    _put(folder / "surroundings.csv", _table(("what", "found"), about.items()))
    known = requirements()
    for one in known:
        _put(folder / "requirements" / f"{one.id}.csv", _tests(told, one.tests))
    for claim in sorted({one.claim for one in known}):
        tests = [path for one in known if one.claim == claim for path in one.tests]
        _put(folder / "claims" / f"{claim.replace(' ', '_')}.csv", _tests(told, tests))
    for number, fault in enumerate(malfunctions(), start=1):
        _put(folder / "malfunctions" / f"M{number:02}.csv", _tests(told, fault.tests))
    _put(folder / "examples.csv", _examples(folder, example))
    try:
        _put(folder / BILL, bill())
    except OSError as error:
        (folder / BILL).unlink(missing_ok=True)
        print(f"{BILL}: {error}")
    asked = lines((folder / "assurance.md").read_text(encoding="utf-8"))
    rows = [(one.section, one.text, one.file, "there" if (folder / one.file).exists() else "missing") for one in asked]
    _put(folder / "answers.csv", _table(("section", "line", "answered by", "state"), rows))
    return [one for one in asked if not (folder / one.file).exists()]


def _examples(folder: Path, example: Callable[[str, Path], Mapping[str, Any]]) -> str:
    """Generate and verify the examples; return the scope of each, part by part."""
    rows: list[tuple[str, ...]] = []
    for name in EXAMPLES:
        said = example(name, folder / "examples" / name)
        _put(folder / "examples" / name / "verify.json", json.dumps(said, indent=1) + "\n")
        rows += [(name, part, str(value["state"]), str(value["why"])) for part, value in said["scope"].items()]
    return _table(("example", "part", "state", "why"), rows)


def _tests(told: Sequence[Mapping[str, str]], paths: Sequence[str]) -> str:
    """Return what became of all tests of some files and folders."""
    rows = [
        (one["test"], one["outcome"], one["reason"])
        for one in told
        if any(one["test"].split("::")[0] == path or one["test"].startswith(f"{path}/") for path in paths)
    ]
    return _table(("test", "outcome", "reason"), sorted(rows))


def _table(head: Sequence[str], rows: Any) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(rows)
    return text.getvalue()


def _put(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
