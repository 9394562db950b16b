"""The dossier of a qualification: a file answers each line of the assurance page."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from benchmarks.qualification import answers
from benchmarks.qualification.requirements import malfunctions, requirements

DOCUMENT = (Path(__file__).parents[2] / "docs" / "assurance.md").read_text(encoding="utf-8")
ABOUT = {"Python": "3"}
TOLD = json.dumps({"test": "tests/formal/test_lock.py::test_it", "outcome": "passed", "reason": ""}).encode() + b"\n"


def example(name: str, folder: Path) -> Mapping[str, Any]:
    del folder
    return {"name": name, "scope": {"arithmetic": {"state": "proven", "why": "the bound follows"}}}


def no_bill() -> str:
    raise OSError("no network")


def rows(path: Path) -> list[list[str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def test_every_section_claim_row_and_paragraph_is_a_line() -> None:
    found = answers.lines(DOCUMENT)
    assert {line.section for line in found} == {str(k) for k in range(1, 15)}
    of = {number: [line.text for line in found if line.section == number] for number in ("2", "10", "11", "12")}
    assert [text[:2] for text in of["2"][1:]] == [f"C{k}" for k in range(1, 8)]
    assert [text[:3] for text in of["10"][1:]] == [one.id for one in requirements()]
    assert len(of["11"]) == 1 + len(malfunctions())
    assert of["12"][1:] == ["Intended use", "Limits", "Access", "Independence", "Known defects", "Components"]


def test_a_line_that_nothing_answers_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^a file must answer the line 'Something new' of section 15$"):
        answers.lines(DOCUMENT + "\n## 15. Something new\n")


def test_the_dossier_has_a_file_for_each_line(tmp_path: Path) -> None:
    assert answers.write(tmp_path, TOLD, about=ABOUT, example=example, bill=lambda: "{}\n") == []
    table = rows(tmp_path / "answers.csv")
    assert {row[3] for row in table[1:]} == {"there"}
    assert len(table) == 1 + len(answers.lines(DOCUMENT))
    assert rows(tmp_path / "requirements" / "R19.csv")[1:] == [["tests/formal/test_lock.py::test_it", "passed", ""]]
    assert rows(tmp_path / "requirements" / "R01.csv")[1:] == []
    assert rows(tmp_path / "examples.csv")[1:] == [
        [name, "arithmetic", "proven", "the bound follows"] for name in answers.EXAMPLES
    ]


def test_what_cannot_be_made_is_missing_and_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    missing = answers.write(tmp_path, TOLD, about=ABOUT, example=example, bill=no_bill)
    assert [line.text for line in missing] == ["Components"]
    assert "components.cdx.json: no network" in capsys.readouterr().out
    assert [row[1] for row in rows(tmp_path / "answers.csv") if row[3] == "missing"] == ["Components"]
