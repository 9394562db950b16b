"""Loops that take turns: proven against the certificate's graph, and each wrong one is rejected."""

import re

import pytest
from tests.gen.block_specifications import designed
from tests.verify.parallel.cores import Made, looking_ahead, made
from tests.verify.parallel.rejections import NODE, rejection, sweep
from tests.verify.small_specifications import INSTRUMENT, NARROW, PLAIN, STEADY, STEADY_INSTRUMENT

FIRST_ORDER = PLAIN.replace("order = 2", "order = 1")


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
        r"(turn_next = turn_is_2 \? 2'h)0 :",
        r"\g<1>1 :",
        r"section1\.turn must be 0 after a clock with aresetn = 1, section1\.turn = 2, .*",
    ),
    "a turn too short": (
        r"(assign turn_is_2 = turn == 2'h)2",
        r"\g<1>1",
        r"section1\.turn must be 2 after a clock with aresetn = 1, section1\.turn = 1, .*",
    ),
    "never warm": (
        r"(else if \(warm_set\) warm <= 1'h)1",
        r"\g<1>0",
        r"section1\.warm must be 1 after a clock with aresetn = 1, section1\.turn = 2, .*",
    ),
    "warm across a reset": (
        r"if \(rst\) warm <= 1'h0;\n *else if",
        "if",
        r"section1\.warm must be 0 after a clock with aresetn = 0",
    ),
    "a turn across a reset": (
        r"if \(rst\) turn <= 2'h0;\n *else if",
        "if",
        r"section1\.turn must be 0 after a clock with aresetn = 0",
    ),
    "a turn that counts clocks": (
        r"else if \(turn_load\) turn",
        "else if (advance) turn",
        r"section1\.turn must be loaded by one valid bit, not by none",
    ),
    "a cold sample that finds a past": (
        r"(y_6_word_next = y_6_memory_read_data) & \{[^}]*\}",
        r"\1",
        rf"section1\.v must be {NODE}section1, not another value",
    ),
    "half a sample that is cold": (
        r"(y_6_word_next = y_6_memory_read_data & \{) warm1",
        r"\1 1'h0",
        rf"section1\.v must be {NODE}section1, not another value",
    ),
    "warm of a sample behind": (
        r"(y_3_word_next = y_3_memory_read_data & )\{[^}]*\}",
        r"\1{ " + ", ".join(["warm1"] * 13) + " }",
        rf"section1\.y_3_memory must hold {NODE}section1 and be read for the turn of the sample, not for another one",
    ),
    "a word of another turn": (
        r"(y_6_memory_read_data = y_6_memory\[)turn1\]",
        r"\1turn]",
        rf"section1\.y_6_memory must hold {NODE}section1 and be read for the turn of the sample, not for another one",
    ),
    "written a turn early": (
        r"y_3_memory\[turn2\] <=",
        "y_3_memory[turn1] <=",
        rf"section1\.y_3_memory must hold {NODE}section1 and be written for the turn of the sample",
    ),
    "another word written": (
        r"(y_3_memory\[turn2\] <= )v\[14:2\]",
        r"\1v[13:1]",
        rf"section1\.y_3_memory must hold {NODE}section1 and take over {NODE}section1 of 0 samples ago, not another "
        "value",
    ),
    "written while the pipeline stands": (
        r"assign y_3_memory_write_enable = advance & valid2",
        "assign y_3_memory_write_enable = valid2",
        rf"section1\.y_3_memory must hold {NODE}section1, which stays while no sample leaves position 4",
    ),
    "too few words": (
        r"(reg \[12:0\] y_3_memory \[)2:0\];(.*?)    y_3_memory\[2\] = 13'h0000;\n",
        r"\g<1>1:0];\2",
        r"section1\.turn must be 0 after a clock with aresetn = 1, section1\.turn = 1, .*",
    ),
}


@pytest.mark.parametrize("kind", BREAKS)
def test_each_kind_of_break_is_named(kind: str) -> None:
    core = looking_ahead()
    old, new, sentence = BREAKS[kind]
    text, count = re.subn(old, new, core.text, flags=re.DOTALL)
    assert count == 1
    assert re.fullmatch(sentence, rejection(core, text)), rejection(core, text)


WIDE = PLAIN.replace("bits = 8", "bits = 18")
"""The products of its recursion take two multiplier blocks each, and drop the bits below those of their sum."""

PIECES = {
    "a piece by another number": (r"(assign scale_13 = y_3_word\[16:0\] \* 15'h554)f", r"\g<1>e"),
    "pieces of another cut": (r"y_3_word\[24:17\]", "y_3_word[23:16]"),
    "a piece a place too low": (r"\{ scale_12_passed3, 17'h00000 \}", "{ scale_12_passed3, 16'h0000 }"),
    "a lower piece with a sign": (r"\$signed\(\{ 1'h0, scale_13_passed3 \}\)", "$signed(scale_13_passed3)"),
    "a piece of the sample behind": (r"(product_A1 \} = .*1'h0, )scale_13_passed3", r"\1scale_13"),
    "a product that is rounded up": (r"(product_A1 \} = .*, )17'h00000", r"\g<1>17'h1ffff"),
    "a product that drops a bit more": (r"product_A1\[38:17\]", "{ product_A1[38:18], 1'h0 }"),
}


def test_products_in_pieces_are_proven() -> None:
    core = looking_ahead(WIDE, multipliers=20)
    accept(core)
    assert core.text.count(" * ") == core.design.architecture.multiplier_blocks == 11


@pytest.mark.parametrize("kind", PIECES)
def test_each_wrong_piece_is_rejected(kind: str) -> None:
    core = looking_ahead(WIDE, multipliers=20)
    old, new = PIECES[kind]
    text, count = re.subn(old, new, core.text)
    assert count == 1
    assert re.match(r"section1\.\w+ must ", rejection(core, text))


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
