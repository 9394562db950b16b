"""`./run qualify`: the requirements, and the page with what became of their tests."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from benchmarks.qualification import outcomes
from benchmarks.qualification.__main__ import DOCUMENT, documented
from benchmarks.qualification.dossier import page
from benchmarks.qualification.requirements import Requirement, malfunctions, requirements
from benchmarks.qualification.surroundings import ROOMS, digests, surroundings

ROOT = Path(__file__).parents[2]

SHOWN = Requirement("R01", "C1", "It holds.", ("tests/a",))
OTHER = Requirement("R02", "C2", "It holds <too>.", ("tests/b/test_b.py",))


def lines(*told: tuple[str, str, str]) -> bytes:
    names = ("test", "outcome", "reason")
    return b"".join(json.dumps(dict(zip(names, one, strict=True))).encode() + b"\n" for one in told)


def made(told: bytes) -> tuple[str, bool]:
    about = {"sosmith": "0.1.0", "Python": "3"}
    return page((SHOWN, OTHER), told, about=about, digests={"model": "0" * 64}, date="2026-11-25", slow=False)


def counts(text: str, name: str) -> list[str]:
    (row,) = re.findall(rf"<tr><td>{name}</td>.*?</tr>", text, re.DOTALL)
    return [re.sub(r"<.*?>", "", cell) for cell in re.findall(r"<td.*?</td>", row)][3:]


def test_identifiers_stay_and_every_test_is_there() -> None:
    known = requirements()
    assert [one.id for one in known] == [f"R{k:02}" for k in range(1, len(known) + 1)]
    paths = [path for one in (*known, *malfunctions()) for path in one.tests]
    assert [path for path in paths if not (ROOT / path).exists()] == []


def test_every_proof_and_every_check_of_the_verifier_belongs_to_a_requirement() -> None:
    tests = [path for room in ("verify", "formal") for path in (ROOT / "tests" / room).rglob("test_*.py")]
    known = requirements()
    loose = {path.relative_to(ROOT).as_posix() for path in tests}
    assert {path for path in loose if not any(one.shown_by(path) for one in known)} == set()


def test_the_document_has_the_tables_as_they_are() -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    assert documented(text) == text


def test_a_requirement_is_shown_by_tests_that_pass() -> None:
    told = lines(("tests/a/test_a.py::test_it[1]", "passed", ""), ("tests/b/test_b.py::test_it", "passed", ""))
    text, shown = made(told)
    assert shown
    assert counts(text, "R01") == counts(text, "R02") == ["1", "0", "0", "shown"]
    assert "All 2 tests that ran have passed." in text
    assert "It holds &lt;too&gt;." in text


@pytest.mark.parametrize(
    ("outcome", "verdict", "said"),
    [
        ("failed", ["0", "1", "0", "failed"], "1 of 2 tests failed."),
        ("skipped", ["0", "0", "1", "not run"], "No test of R02 ran."),
    ],
)
def test_one_that_fails_or_does_not_run_shows_nothing(outcome: str, verdict: list[str], said: str) -> None:
    told = lines(("tests/a/test_a.py::test_it", "passed", ""), ("tests/b/test_b.py::test_it", outcome, "no coqc"))
    text, shown = made(told)
    assert not shown
    assert counts(text, "R02") == verdict
    assert said in text
    assert ("<td>no coqc</td>" in text) == (outcome == "skipped")


def test_a_test_of_another_folder_shows_nothing() -> None:
    text, shown = made(lines(("tests/ab/test_a.py::test_it", "passed", "")))
    assert not shown
    assert counts(text, "R01") == ["0", "0", "0", "not run"]


def test_what_became_of_each_test_is_written(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    pytester.makepyfile(
        """
        import pytest
        def test_good(): pass
        def test_bad(): assert False
        def test_skipped(): pytest.skip("not here")
        @pytest.fixture
        def broken(): raise OSError
        def test_broken(broken): pass
        """
    )
    told = pytester.path / "outcomes.jsonl"
    monkeypatch.setenv(outcomes.FILE, str(told))
    monkeypatch.delenv("PYTEST_XDIST_WORKER", raising=False)
    pytester.inline_run("-p", "benchmarks.qualification.outcomes", "-p", "no:cacheprovider")
    found = [json.loads(line) for line in told.read_text().splitlines()]
    assert [(one["test"].split("::")[1], one["outcome"], one["reason"]) for one in found] == [
        ("test_good", "passed", ""),
        ("test_bad", "failed", ""),
        ("test_skipped", "skipped", "not here"),
        ("test_broken", "failed", ""),
    ]


def test_the_machine_and_what_is_qualified_are_named() -> None:
    about = surroundings()
    assert {"sosmith", "revision", "Python", "amaranth", "Verilator"} <= about.keys()
    assert all(about.values())
    found = digests()
    assert found.keys() == {*ROOMS}
    assert all(re.fullmatch("[0-9a-f]{64}", one) for one in found.values())
    assert len({*found.values()}) == len(ROOMS)
