"""The document beside the paper: it is what the command writes, and a wrong figure shows."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from sosmith.cli import cli
from sosmith.instrument.paper.comparison import LABELS
from sosmith.instrument.paper.document import paper_files
from sosmith.instrument.paper.figures import read_paper_figures

pytestmark = pytest.mark.slow  # everything of the paper is computed anew

DOCS = Path(__file__).parents[2] / "docs"


def run(*arguments: str) -> Result:
    return CliRunner(env={"COLUMNS": "120"}).invoke(cli, ["paper", *arguments])


@pytest.fixture(scope="module")
def files() -> dict[str, str]:
    return paper_files(read_paper_figures())


def test_the_document_is_what_the_command_writes(files: dict[str, str]) -> None:
    assert (DOCS / "paper.md").read_text(encoding="utf-8") == files["paper.md"]


def test_the_pictures_are_what_the_command_draws(files: dict[str, str]) -> None:
    drawn = {name: text for name, text in files.items() if name != "paper.md"}
    there = {path.relative_to(DOCS).as_posix() for path in (DOCS / "images").glob("paper_*")}
    assert there == set(drawn)
    assert [name for name, text in drawn.items() if (DOCS / name).read_text(encoding="utf-8") != text] == []


def test_the_document_shows_its_pictures(files: dict[str, str]) -> None:
    assert [name for name in files if name != "paper.md" and f"]({name})" not in files["paper.md"]] == []


def test_o_writes_document_and_pictures(tmp_path: Path, files: dict[str, str]) -> None:
    result = run("-o", str(tmp_path / "ours.md"))
    assert (result.exit_code, result.stdout) == (0, "")
    written = {path.relative_to(tmp_path).as_posix(): path.read_text() for path in tmp_path.rglob("*.*")}
    assert written == {("ours.md" if name == "paper.md" else name): text for name, text in files.items()}


def test_without_options_it_prints_the_summary() -> None:
    result = run()
    assert result.exit_code == 0
    assert all(label in result.stdout for label in (*LABELS, "Table 3", "Equation 16"))


def test_json_has_every_comparison() -> None:
    result = run("--json")
    assert result.exit_code == 0
    parts = {part["title"]: part for part in json.loads(result.stdout)}
    stated = parts["Table 1"]["comparisons"][-2]
    assert (stated["printed"], stated["ours"], stated["label"]) == ("96.1826", "96.18258", "reproduced")
