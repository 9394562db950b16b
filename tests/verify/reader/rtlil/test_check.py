"""An RTLIL against the SystemVerilog beside it: what is written is the same, and whatever is changed in it is not."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from tests.verify.multirate.decimators import Case
from tests.verify.small_specifications import PLAIN, STEADY

from sosmith.gen.core import design_core
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.gen.specification.specification import from_text
from sosmith.verify.graph import RejectedError
from sosmith.verify.reader.rtlil.check import RtlilVerdict, check_rtlil
from sosmith.verify.reader.rtlil.syntax import read_rtlil
from sosmith.verify.reader.source import read_source
from sosmith.verify.reader.syntax import Module

FIXED = 'hardware.realization = "df1_ef1"\nhardware.architecture = '
TEXTS = {
    "parallel": PLAIN + FIXED + '"parallel"\n',
    "folded": STEADY + FIXED + '"folded"\n',
    "channels": PLAIN.replace("sample_rate", "channels = 3\nsample_rate", 1) + FIXED + '"parallel"\n',
    "ahead": PLAIN + 'hardware.architecture = "parallel"\nhardware.pipeline = "look-ahead"\n',
    "protected": STEADY + FIXED + '"folded"\nhardware.protect = "detect"\n',
    "protected channels": Case(channels=3).text + 'protect = "correct"\n',
}
"""The last one has sums of words with check bits, which are the same only below the gates that both texts have."""


FAST = ("parallel", "folded", "channels", "ahead")


class Texts(NamedTuple):
    rtlil: str
    modules: Mapping[str, Module]

    def check(self, rtlil: str | None = None) -> RtlilVerdict:
        return check_rtlil(rtlil or self.rtlil, self.modules)


@pytest.fixture(scope="module")
def texts() -> Callable[[str], Texts]:
    @cache
    def made(name: str) -> Texts:
        design = design_core(from_text(TEXTS[name], Path("spec.toml")))
        rtlil = to_rtlil(design.architecture.component(), "plain")
        return Texts(rtlil, read_source(to_verilog(rtlil), "plain").modules)

    return made


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    "name", [*FAST, *(pytest.param(name, marks=pytest.mark.slow) for name in ("protected", "protected channels"))]
)
def test_what_is_written_is_the_same(name: str, texts: Callable[[str], Texts]) -> None:
    found = texts(name).check()
    assert found.register_bits > 100
    assert found.open == ()


DATA = r"(meminit_v2(?:.*\n){7} +connect \\DATA \d+')"
EDITS = [
    (r"cell \$and ", "cell $or ", "another operation"),
    (r"cell \$sub |cell \$add ", "cell $xor ", "another sum"),
    (r"cell \$eq ", "cell $ne ", "another comparison"),
    (r"cell \$dff ", "cell $dlatch ", "a latch"),
    (r"CLK_POLARITY 1", "CLK_POLARITY 0", "the falling edge"),
    (r"(?s)A_SIGNED 1\n.*", lambda found: found[0].replace("_SIGNED 1", "_SIGNED 0"), "no sign"),
    (r"attribute \\init 1'0(\n +wire width 1 \\(?:busy|valid1)\n)", r"attribute \\init 1'1\1", "another beginning"),
    (r"attribute \\init \d+'0+\n( +wire width \d+ signed \\v1\n)", r"\1", "no beginning"),
    (r"(      case 1'1\n        assign \$\d+ .*) \$(\d+) \[0\]\n", r"\1 1'0\n", "another value"),
    (r"case 1'1", "case 1'0", "another case"),
    (r"case 1'1", "case", "any case"),
    (r"connect \\D \$\d+ \[(\d+):0\]", r"connect \\D \\s_axis_tdata [\1:0]", "another source"),
    (r"connect \\CLK \\(a?clk) \[0\]", r"connect \\CLK \\rst [0]", "another clock"),
    (r"output (\d+)  \\s_axis_tready", r"input \1  \\s_axis_tready", "another direction"),
    (r"attribute \\generator", r"attribute \\blackbox", "an attribute that tools obey"),
    (r"attribute \\init 1'0\n", "attribute \\\\init 1'0\n  attribute \\\\full_case 1\n", "another attribute"),
    (r"\A", "# a comment\n", "a comment"),
    (r"\A", "autoidx 3\n", "another statement"),
    (r"\Z", r"\nmodule \\other\nend\n", "another module"),
    (r"\nend\n", "\nend\nend\n", "an end too many"),
    (r"  cell \$and (\$\d+)\n", r"  cell $and \1\n    connect \\A 1'0\n", "a port twice"),
    (r"parameter \\Y_WIDTH 1\n", r"parameter \\Y_WIDTH 2\n", "another width"),
    (r"  process (\$\d+)\n", r"  process \1\n    sync always\n", "a latch by a process"),
    (r"assign (\$\d+) \[0\] 1'0", r"assign \1 [0] 1'x", "anything"),
    (r"connect \\Y (\$\d+|\\\w+)\n", r"connect \\Y \1 [9]\n", "a bit that is not there"),
]


@pytest.mark.parametrize(("old", "new", "what"), EDITS, ids=[what for _, _, what in EDITS])
def test_what_does_something_else_is_refused(old: str, new: Any, what: str, texts: Callable[[str], Texts]) -> None:
    """The edit is made in the first of three texts that has such a place."""
    for name in ("folded", "parallel"):
        text = texts(name).rtlil
        changed = re.sub(old, new, text, count=1)
        if changed != text:
            with pytest.raises(RejectedError):
                texts(name).check(changed)
            return
    pytest.fail(f"there must be a place for {what}")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (r"parameter \\TRANSPARENCY_MASK 0'0", r"parameter \\TRANSPARENCY_MASK 1'1"),
        (r"connect \\SRST 1'0", r"connect \\SRST 1'1"),
        (r"connect \\EN 1'1", r"connect \\EN 1'0"),
        (rf"{DATA}0", r"\g<1>1"),
        (r"connect \\EN \{ \S+", r"connect \\EN { \\busy"),
        (r"(connect \\EN \{ \\words0_write_enable \[0\].*)", r"connect \\EN 16'1111111111111111"),
        (r"attribute \\no_rw_check 1\n", ""),
        (r"memory width (\d+) size (\d+)", r"memory width \1 size 9\2"),
        (r"connect \\ADDR \\words0_write_address", r"connect \\ADDR \\instruction2_address"),
    ],
)  # fmt: skip
def test_other_memories_are_refused(old: str, new: str, texts: Callable[[str], Texts]) -> None:
    text = texts("folded").rtlil
    changed = re.sub(old, new, text, count=1)
    assert changed != text
    with pytest.raises(RejectedError):
        texts("folded").check(changed)


def test_random_changes_are_refused_or_change_nothing(texts: Callable[[str], Texts]) -> None:
    """Cells change their kinds, and what is connected its bits: what is accepted is read by nobody."""
    text, rng, accepted = texts("parallel").rtlil, random.Random(5), 0
    places = list(
        re.finditer(r"(?<=connect \\[AB] )(\S+) \[(\d+)(?::\d+)?\]|(?<=cell )\$(?:and|or|add|sub|eq|mux)\b", text)
    )
    for _ in range(12):
        place = rng.choice(places)
        if place[1]:
            new = f"{place[1]} [0]" if place[2] != "0" else "1'0"
        else:
            new = rng.choice(["$and", "$or", "$add", "$sub", "$eq", "$ne"])
        changed = f"{text[: place.start()]}{new}{text[place.end() :]}"
        if changed == text:
            continue
        try:
            accepted += texts("parallel").check(changed).open == ()
        except RejectedError:
            continue
    assert accepted <= 3


@pytest.mark.parametrize(
    "text", ["", "module", "module \\plain\n", "module \\plain\n  cell $and $1\nend\n", "\x00", "[" * 9999]
)
def test_what_is_no_rtlil_is_refused(text: str, texts: Callable[[str], Texts]) -> None:
    with pytest.raises(RejectedError):
        check_rtlil(text, texts("parallel").modules)


def test_sentences(texts: Callable[[str], Texts]) -> None:
    folded = texts("folded")
    with pytest.raises(RejectedError, match=r"^line 3 of the RTLIL must be attribute or module, not 'module plain'$"):
        folded.check(folded.rtlil.replace("module \\plain", "module plain", 1))
    with pytest.raises(
        RejectedError, match=r"^the modules of the RTLIL must be those of the SystemVerilog, not other besides$"
    ):
        folded.check(folded.rtlil + "module \\other\nend\n")
    changed = re.sub(rf"{DATA}0", r"\g<1>1", folded.rtlil, count=1)
    sentence = r"^the memory \w+ of plain_\w+ must be the same in the RTLIL as in the SystemVerilog$"
    with pytest.raises(RejectedError, match=sentence):
        folded.check(changed)
    parts = ("sequencer", "program_memory", "word_memory", "multiply_accumulate", "result")
    assert set(read_rtlil(folded.rtlil)) == {"plain", *(f"plain_{part}" for part in parts)}


@pytest.mark.parametrize(
    ("right", "wrong", "sentence"),
    [
        (
            r"parameter \\WIDTH 1\n",
            r"parameter \\WITH 1\n",
            r"a cell .* must have the parameters .*WITH",
        ),
        (r"parameter \\WIDTH 1\n", "", r"a cell \$\w+ .* must have the parameters .*"),
        (r"parameter \\WIDTH 1\n", r"parameter \\WIDTH 2\n", r"WIDTH of a cell \$\w+ must be that of \w"),
        (r"(parameter \\WIDTH 1\n)", r"\1 parameter \\A_SIGNED 1\n", r"a cell .* must have the parameters .*"),
        (
            r"(parameter \\CLK_POLARITY \S+\n)",
            r"\1 connect \\EN \\rst\n",
            r"a cell \$dff .* the ports CLK, D, Q, not .*",
        ),
        (
            r"(cell \$mux \S+\n)",
            r"\1 connect \\T \\rst\n",
            r"a cell \$mux of the RTLIL must have the ports A, B, S, Y, .*",
        ),
    ],
)
def test_a_cell_is_one_that_every_tool_takes(
    right: str, wrong: str, sentence: str, texts: Callable[[str], Texts]
) -> None:
    made = texts("parallel")
    changed, count = re.subn(right, wrong, made.rtlil, count=1)
    assert count == 1
    with pytest.raises(RejectedError, match=f"^{sentence}"):
        made.check(changed)


def test_a_memory_that_nobody_reads_may_be_missing(texts: Callable[[str], Texts]) -> None:
    extra = "  memory width 3 size 4 \\unread\n"
    first = re.search(r"^  memory width .*\n", texts("channels").rtlil, re.MULTILINE)
    assert first is not None
    assert texts("channels").check(texts("channels").rtlil.replace(first[0], extra + first[0], 1)).open == ()
