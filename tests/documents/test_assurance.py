"""docs/assurance.md: its figures are those that the commands recorded, and none of them is a silent upset."""

import json
import re

from benchmarks import edge, rocq, upsets
from benchmarks.mutation.record import RECORD as MUTATION
from benchmarks.mutation.record import markdown

from sosmith.gen.realizations.registry import REALIZATIONS
from sosmith.gen.specification.choices import FAMILIES, KINDS

RECORD = json.loads(upsets.RECORD.read_text(encoding="utf-8"))


def test_the_upsets_are_those_of_the_record() -> None:
    assert upsets.TABLE.findall(upsets.DOCUMENT.read_text(encoding="utf-8")) == [upsets.table(RECORD)]


def test_the_mutations_are_those_of_the_record() -> None:
    text = upsets.DOCUMENT.read_text(encoding="utf-8")
    shown = re.findall(r"(?<=<!-- mutation -->\n).*?(?=<!-- end of mutation -->)", text, re.DOTALL)
    assert shown == [markdown(json.loads(MUTATION.read_text(encoding="utf-8")))]


def test_every_core_was_hit_in_every_kind_of_place() -> None:
    assert [row["kind"] for row in RECORD if row["protect"] == "none"] == []
    for core in upsets.CORES:
        kinds = {row["kind"] for row in RECORD if upsets.Core(*(row[name] for name in upsets.Core._fields)) == core}
        assert "other registers" in kinds
        assert kinds & {"memories", "states in registers"}
        assert ("two bits of a word in memories" in kinds) == (core.protect == "correct" and "memories" in kinds)
    assert all(row["runs"] == upsets.KINDS[row["kind"]] for row in RECORD)
    assert min(upsets.KINDS[kind] for kind in ("memories", "states in registers")) >= 10_000


def test_no_upset_was_silent() -> None:
    assert upsets.silent(RECORD) == 0


def test_a_silent_upset_would_be_counted() -> None:
    (memories, *_) = [row for row in RECORD if row["kind"] == "memories"]
    (others, *_) = [row for row in RECORD if row["kind"] == "other registers"]
    assert upsets.silent([memories | {"silent": 2}, memories | {"lost": 1}, others | {"silent": 5}]) == 3


def test_the_counts_of_the_edge_are_those_of_the_record() -> None:
    recorded = json.loads(edge.RECORD.read_text(encoding="utf-8"))
    assert recorded.keys() == edge.PARTS.keys()
    shown = re.findall(r"(?<=<!-- edge -->\n).*?(?=<!-- end of edge -->)", edge.DOCUMENT.read_text("utf-8"), re.DOTALL)
    assert shown == [edge.table(recorded)]


def test_nothing_was_found_at_the_edge_by_as_many_as_are_asked_for() -> None:
    recorded = json.loads(edge.RECORD.read_text(encoding="utf-8"))
    counts = {what: count for rows in recorded.values() for what, count in rows.items()}
    assert {count for what, count in counts.items() if what.endswith("findings")} == {0}
    for what in (
        "host: lies among them, false identities included",
        "board: hostile messages to its model, with and without registers",
        "studio: hostile requests, frames and messages",
        "page of `monitor`: hostile requests, frames and messages",
    ):
        assert counts[what] >= 10_000
    assert counts["kills in all"] >= 1000
    assert counts[f"environments, of {len(edge.COMMANDS)} calls of commands"] >= 200


def test_what_rocq_refused_and_accepted_is_that_of_the_record() -> None:
    record = json.loads(rocq.RECORD.read_text(encoding="utf-8"))
    assert rocq.PART.findall(rocq.DOCUMENT.read_text(encoding="utf-8")) == [rocq.table(record)]
    edits, designs = record["edits"], record["designs"]
    assert edits["refused"] == edits["tried"] >= rocq.EDITS
    assert designs["accepted"] == designs["tried"] == len(designs["verdicts"]) >= rocq.DESIGNS
    words = {word for name in designs["verdicts"] for word in name.replace(",", "").split()}
    assert words >= {*REALIZATIONS, *FAMILIES, *KINDS}
