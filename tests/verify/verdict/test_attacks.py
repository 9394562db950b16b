"""The attacks of benchmarks.attacks: a few of each class here, and what the command would say of a finding."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from benchmarks.attacks import __main__ as command
from benchmarks.attacks import campaign, certificates, texts
from benchmarks.attacks.campaign import Outcome
from benchmarks.attacks.cores import NAME, Core, made

from sosmith.verify.certificate_file import read_certificate
from sosmith.verify.graph import RejectedError
from sosmith.verify.reader.source import read_source


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> Core:
    return made("parallel, from zero", tmp_path_factory.mktemp("attacked"))


def refusal(text: str) -> str | None:
    """Return the sentence with which the reader refuses a text; None if it reads it."""
    try:
        read_source(text, NAME)
    except RejectedError as error:
        return str(error)
    return None


def test_wrong_texts_end_in_a_sentence_or_are_read(core: Core) -> None:
    kinds, mutants = zip(*(texts.mutant(core.text, f"test/{number}") for number in range(120)), strict=True)
    said = [refusal(text) for text in mutants]
    assert set(kinds) == set(texts.CLASSES)
    assert 5 < said.count(None) < 60
    assert [sentence for sentence in said if sentence is not None and " must " not in sentence] == []


def test_wrong_certificates_are_refused_or_claim_nothing_else(core: Core) -> None:
    outcome = Outcome()
    campaign._attack_certificates(core, 25, outcome)
    assert outcome.findings == []
    assert outcome.counts["certificates"] == 25
    assert outcome.counts["certificates, refused"] > 15


def test_a_certificate_that_claims_more_would_be_found(core: Core) -> None:
    tree = read_certificate(core.certificate).model_dump(mode="json", exclude_defaults=True)
    for place, new in (
        (("claims", "bound"), "1/1000"),
        (("stages", 0, "nodes", 0, "high"), 1),
        (("about", "item", "channels"), 2),
    ):
        other = json.loads(json.dumps(tree))
        certificates.at(other, place[:-1])[place[-1]] = new
        (said,) = campaign.differing(tree, other)
        assert said.startswith(".".join(map(str, place)))
    assert campaign.differing(tree, tree) == []


def test_a_text_that_a_tool_sees_otherwise_would_be_found(
    core: Core, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = {"icarus": ["1", "1"], "verilator": ["1", "2"], "yosys": ["1", "x1"]}
    monkeypatch.setattr(campaign, "traces", lambda *_: seen)
    outcome = Outcome()
    right = read_source(core.text, NAME)
    campaign._ask_the_tools(core, [core.text, core.text + "// a\n"], right, tmp_path, outcome)
    where = """not 1, in '+// a'"""
    assert outcome.findings == [
        f"{core.kind}: {tool} sees {trace}, {where}" for tool, trace in (("verilator", 2), ("yosys", "x1"))
    ]


def test_a_core_whose_own_files_are_refused_would_be_found(tmp_path: Path) -> None:
    refused = made("parallel, lockable", tmp_path)
    outcome = Outcome()
    campaign._judge_the_right(refused, outcome)
    assert outcome.findings == []
    (tmp_path / f"{NAME}.c").write_text("")
    campaign._judge_the_right(refused, outcome)
    (said,) = outcome.findings
    assert said.startswith("parallel, lockable: its own files are refused: ")


def test_a_traceback_would_be_found() -> None:
    def broken() -> str:
        raise ZeroDivisionError("by 0")

    outcome = Outcome()
    assert outcome.timed("text 1", broken) == "traceback"
    assert outcome.findings == ["text 1: ZeroDivisionError by 0"]


def test_the_counts_are_those_of_the_record() -> None:
    record = json.loads(command.RECORD.read_text(encoding="utf-8"))
    assert command.PART.findall(command.DOCUMENT.read_text(encoding="utf-8")) == [command.table(record)]
    # Another exact filter, for which the certificate is proven as well, is what the document explains.
    assert [finding for finding in record["findings"] if ": accepted with ideal." not in finding] == []
