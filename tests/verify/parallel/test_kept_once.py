"""What a core keeps in one place, and what it adds before a state has taken it over: proven, and broken on purpose."""

import re
from functools import cache
from pathlib import Path

import pytest
from tests.verify.parallel.cores import Made, made, specified
from tests.verify.parallel.rejections import NODE, rejection

from sosmith.gen.core import design_core

AUDIO = (Path(__file__).parents[3] / "examples" / "audio_lowpass.toml").read_text(encoding="utf-8")

LOW = """
name = "plain"
sample_rate = 48000.0
input.x = { bits = 16, signed = true, range = [-1.0, 1.0] }
filter = { family = "butterworth", kind = "lowpass", order = 2, cutoff = 300.0 }
output = { bits = 11, signed = true, range = [-1.0, 1.0], unit = "", max_error = "faithful" }
hardware.start = "zero"
"""
NOTCH = """
name = "notch"
sample_rate = 48000.0
input.voltage = { bits = 23, range = [0.0, 10.0] }
input.temperature = { bits = 15, range = [0.0, 128.0] }
calibration.coefficients = [[1.16, -0.0036], [0.3672, 0.0006618], [0.05812]]
filter = { family = "butterworth", kind = "bandstop", order = 4, cutoff = [236.15456408633347, 654.2615842610105] }
output = { bits = 11, range = [0.0, 16.0], unit = "mm", max_error = 0.0078125 }
hardware = { clock = 48.0e6, architecture = "parallel", realization = "df1" }
"""


@cache
def core() -> Made:
    return made(design_core(specified(AUDIO.replace('architecture = "auto"', 'architecture = "parallel"'))))


@cache
def low() -> Made:
    return made(design_core(specified(LOW), realization="df1"))


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


def test_an_error_that_is_a_part_of_a_net_with_another_name() -> None:
    core = low()
    assert "valid1 ? taps_A2_exact[7:0] : error_A2;" in core.text
    assert "error_A2 <= taps_A2_exact[7:0];" in core.text
    assert core.check().states == 6


@pytest.mark.slow
def test_an_error_that_is_a_part_of_a_register() -> None:
    core = made(design_core(specified(NOTCH)))
    assert "valid1 ? taps_b0_exact_passed1[7:0] : error_b0;" in core.text
    assert "error_b0 <= taps_b0_exact_passed1[7:0];" in core.text
    assert core.check().states > 20
    text = core.text.replace("error_b0 <= taps_b0_exact_passed1[7:0];", "error_b0 <= taps_b0_exact_passed1[8:1];")
    text = text.replace("valid1 ? taps_b0_exact_passed1[7:0]", "valid1 ? taps_b0_exact_passed1[8:1]")
    assert rejection(core, text).startswith("section3.")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("valid1 ? taps_A2_exact[7:0] : error_A2;", "valid1 ? error_A2 : taps_A2_exact[7:0];"),
        ("valid1 ? taps_A2_exact[7:0] : error_A2;", "valid1 ? taps_A2_exact[8:1] : error_A2;"),
        ("valid1 ? taps_A2_exact[7:0] : error_A2;", "valid2 ? taps_A2_exact[7:0] : error_A2;"),
        ("valid1 ? taps_A2_exact[7:0] : error_A2;", "taps_A2_exact[7:0];"),
        ("error_A2 <= taps_A2_exact[7:0];", "error_A2 <= taps_A2_exact[8:1];"),
        ("taps_A2_exact[7:0]", "taps_A2_exact[8:1]"),
        ("else if (take1) error_A2 <=", "else if (take2) error_A2 <="),
    ],
)
def test_another_part_is_refused(old: str, new: str) -> None:
    text = low().text.replace(old, new)
    assert text != low().text
    assert re.fullmatch(rf"section0\.\w+ must .*{NODE}section0.*", rejection(low(), text))
