"""What a core keeps in one place, and what it adds before a state has taken it over: proven, and broken on purpose."""

import re
from functools import cache
from pathlib import Path

import pytest
from tests.verify.parallel.cores import Made, made, specified
from tests.verify.parallel.rejections import NODE, rejection

from sosmith.gen.core import design_core

AUDIO = (Path(__file__).parents[3] / "examples" / "audio_lowpass.toml").read_text(encoding="utf-8")


@cache
def core() -> Made:
    return made(design_core(specified(AUDIO.replace('architecture = "auto"', 'architecture = "parallel"'))))


def test_the_first_sample_and_the_errors_of_operands() -> None:
    text = core().text
    assert "held_passed" not in text
    assert text.count("valid1 ? error_A2_next : error_A2") == 2
    assert core().check().states == 17


BREAKS = {
    "the error of the sample before the last": (
        r"valid1 \? error_A2_next : error_A2",
        "valid1 ? error_A2 : error_A2_next",
        rf"section\d\.add_\d+_passed1 must be {NODE}section\d, but .* must take over the same whatever other positions "
        "hold",
    ),
    "an error that the state does not take over": (
        r"  assign \{ (n\d+\[\d+:\d+\], floor_\d+), error_A2_next \} = (\$signed\(add_\d+_passed1\).*?;)",
        r"  wire WIDTH other;\n  assign error_A2_next = other + 1'h1;\n  assign { \1, other } = \2",
        rf"section\d\.error_A2_next must be {NODE}section\d, not another value",
    ),
    "a first sample that changes": (
        r"assign first_load = & \{ not_started, take0 \};",
        "assign first_load = take0;",
        rf"start\.first must hold {NODE}start and take over {NODE}start, not another value",
    ),
    "another sample in its place": (
        r"\.held\(start_held\)",
        ".held(start_change[15:0])",
        rf"output_stage\.total must be {NODE}output_stage, not another value",
    ),
    "products off their centre": (
        r"(v1\[\d+:0\]), 1'h1",
        r"\1, 1'h0",
        rf"section\d\.add_\d+ must be {NODE}section\d, not another value",
    ),
}


@pytest.mark.parametrize("kind", BREAKS)
def test_each_break_is_named(kind: str) -> None:
    old, new, sentence = BREAKS[kind]
    (width, *_) = re.findall(r"reg (\[\d+:0\]) error_A2 =", core().text)
    text, count = re.subn(old, new.replace("WIDTH", width), core().text, count=1)
    assert count
    if "other" in new:
        text = text.replace("error_A2 <= error_A2_next", "error_A2 <= other", 1)
    assert re.fullmatch(sentence, rejection(core(), text)), rejection(core(), text)
