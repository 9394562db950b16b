"""Loops that take turns: proven against the certificate's graph, and each wrong one is rejected."""

import re

import pytest
from tests.gen.block_specifications import designed
from tests.verify.parallel.cores import Made, looking_ahead, made
from tests.verify.parallel.rejections import NODE, rejection, sweep
from tests.verify.small_specifications import INSTRUMENT, NARROW, PLAIN, STEADY, STEADY_INSTRUMENT

FIRST_ORDER = PLAIN.replace("order = 2", "order = 1")
SLOWER = FIRST_ORDER.replace("cutoff = 20.0", "cutoff = 13.0")
"""Four samples take turns in its loop."""


def accept(core: Made) -> None:
    found = core.check()
    assert found.latency == core.latency
    assert found.states > found.memories == len(re.findall(r"^  reg .*_memory \[", core.text, re.MULTILINE)) > 0


@pytest.mark.slow
@pytest.mark.parametrize("lanes", [1, 2, 4])
def test_an_example(lanes: int) -> None:
    accept(made(designed(lanes), lanes=lanes, look_ahead=True))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spec", "lanes"),
    [(PLAIN, 1), (NARROW, 1), (STEADY, 2), (STEADY_INSTRUMENT, 1), pytest.param(INSTRUMENT, 4, marks=pytest.mark.slow)],
)
def test_starts_and_a_calibration(spec: str, lanes: int) -> None:
    accept(looking_ahead(spec, lanes))


BREAKS = {
    "a turn too long": (
        r"(turn_next = turn_is_3 \? 2'h)0 :",
        r"\g<1>1 :",
        r"section0\.turn must be 0 after a clock with aresetn = 1, section0\.turn = 3, .*",
    ),
    "a turn too short": (
        r"(assign turn_is_3 = turn == 2'h)3",
        r"\g<1>2",
        r"section0\.turn must be 3 after a clock with aresetn = 1, section0\.turn = 2, .*",
    ),
    "never warm": (
        r"(else if \(warm_set\) warm <= 1'h)1",
        r"\g<1>0",
        r"section0\.warm must be 1 after a clock with aresetn = 1, section0\.turn = 3, .*",
    ),
    "warm across a reset": (
        r"if \(rst\) warm <= 1'h0;\n *else if",
        "if",
        r"section0\.warm must be 0 after a clock with aresetn = 0",
    ),
    "a turn across a reset": (
        r"if \(rst\) turn <= 2'h0;\n *else if",
        "if",
        r"section0\.turn must be 0 after a clock with aresetn = 0",
    ),
    "a turn that counts clocks": (
        r"else if \(turn_load\) turn",
        "else if (advance) turn",
        r"section0\.turn must be loaded by one valid bit, not by none",
    ),
    "a cold sample that finds a past": (
        r"assign y_4 = warm6 \?",
        "assign y_4 = 1'h1 ?",
        rf"section0\.y_4 must be {NODE}section0, not another value",
    ),
    "warm of a sample behind": (
        r"assign y_4 = warm6 \?",
        "assign y_4 = warm5 ?",
        rf"section0\.y_register must be {NODE}section0, but section0\.y_register must take over a word of one sample, "
        "not of 2",
    ),
    "a word of another turn": (
        r"(y_4_memory_read <= y_4_memory\[)turn5\]",
        r"\1turn4]",
        rf"section0\.y_register must be {NODE}section0, but section0\.y_register must take over a word of one sample, "
        "not of 2",
    ),
    "written a turn early": (
        r"y_4_memory\[turn6\] <=",
        "y_4_memory[turn5] <=",
        rf"section0\.y_4_memory must hold {NODE}section0 and be written for the turn of the sample",
    ),
    "another word written": (
        r"(y_4_memory\[turn6\] <= )\{ v\[18\], v\[18:7\] \}",
        r"\1v[18:6]",
        rf"section0\.y_4_memory must hold {NODE}section0 and take over {NODE}section0 of 0 samples ago, not another "
        "value",
    ),
    "written while the pipeline stands": (
        r"assign y_4_memory_write_enable = advance & valid6",
        "assign y_4_memory_write_enable = valid6",
        rf"section0\.y_4_memory must hold {NODE}section0, which stays while no sample leaves position 6",
    ),
    "too few words": (
        r"(reg \[12:0\] y_4_memory \[)3:0\];(.*?)    y_4_memory\[3\] = 13'h0000;\n",
        r"\g<1>2:0];\2",
        r"section0\.turn must be 0 after a clock with aresetn = 1, section0\.turn = 2, .*",
    ),
}


@pytest.mark.parametrize("kind", BREAKS)
def test_each_kind_of_break_is_named(kind: str) -> None:
    core = looking_ahead(SLOWER)
    old, new, sentence = BREAKS[kind]
    text, count = re.subn(old, new, core.text, flags=re.DOTALL)
    assert count == 1
    assert re.fullmatch(sentence, rejection(core, text)), rejection(core, text)


WIDE = FIRST_ORDER.replace("bits = 8", "bits = 18")
"""Its products take two multiplier blocks each."""

PIECES = {
    "a piece by another number": (r"(assign scale_43 = y_4\[16:0\] \* 8'ha)5", r"\g<1>6"),
    "pieces of another cut": (r"y_4\[22:17\]", "y_4[21:16]"),
    "a piece a place too low": (r"\{ scale_42_passed8, 17'h00000 \}", "{ scale_42_passed8, 16'h0000 }"),
    "a lower piece with a sign": (r"\$signed\(\{ 1'h0, scale_43_passed8 \}\)", "$signed(scale_43_passed8)"),
    "a piece of the sample behind": (r"(\{ scale_42_passed8, 17'h00000 \}.*)scale_43_passed8", r"\1scale_43"),
}


def test_products_in_pieces_are_proven() -> None:
    core = looking_ahead(WIDE, multipliers=20)
    accept(core)
    assert core.text.count(" * ") == core.design.architecture.multiplier_blocks == 8


@pytest.mark.parametrize("kind", PIECES)
def test_each_wrong_piece_is_rejected(kind: str) -> None:
    core = looking_ahead(WIDE, multipliers=20)
    old, new = PIECES[kind]
    text, count = re.subn(old, new, core.text)
    assert count == 1
    assert re.match(r"section0\.\w+ must ", rejection(core, text))


@pytest.mark.slow
def test_a_dozen_edits() -> None:
    found = sweep(looking_ahead(FIRST_ORDER), 12, seed=6, clocks=300)
    assert found["accepted"] + found["rejected"] == 12
    assert found["rejected"] > 5


@pytest.mark.slow
@pytest.mark.parametrize(("spec", "lanes"), [(PLAIN, 1), (STEADY, 2), (STEADY_INSTRUMENT, 1)])
def test_hundreds_of_edits(spec: str, lanes: int) -> None:
    found = sweep(looking_ahead(spec, lanes), 200, seed=7, clocks=600)
    assert found["accepted"] + found["rejected"] == 200
    assert found["rejected"] > 100
