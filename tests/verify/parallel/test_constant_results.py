"""A core whose every result is the same is proven like any other: its registers hold a constant at each sample."""

from __future__ import annotations

import re

import pytest
from tests.verify.parallel.cores import Made, made, small_design

from sosmith.verify.graph import RejectedError

FLAT = """
name = "flat"
sample_rate = 100.0
input.voltage = { bits = 4, range = [0.0, 1.0] }
input.temperature = { bits = 4, range = [0.0, 1.0] }
calibration.coefficients = [[0.001]]
filter.taps = [0.001, 0.0001]
output = { bits = 4, range = [-1.0, 0.0] }
hardware = { clock = 12.0e6, architecture = "parallel", start = "START" }
"""


def flat(start: str, channels: int = 3) -> Made:
    return made(small_design(FLAT.replace("START", start), "fir_direct"), channels)


@pytest.mark.parametrize(("start", "channels"), [("steady", 3), ("zero", 2), ("zero", 1)])
def test_the_hardware_is_proven(start: str, channels: int) -> None:
    assert flat(start, channels).check().registers > 5


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (r"if \(advance\) (add_\d+_passed1) <= add_\d+;", r"if (advance) \1 <= 15'h3c00;"),
        (r"if \(advance\) (add_\d+_passed1 <= add_\d+;)", r"if (clear) \1"),
        (r"if \(advance\) (add_\d+_passed1) (<= add_\d+;)", r"if (advance) \1 \2 else \1 <= 15'h3c00;"),
        (r"(if \(advance\) )(add_\d+_passed1) (<= add_\d+;)", r"\1 if (clear) \2 <= 15'h3c00; else \2 \3"),
    ],
)
def test_what_is_not_always_there_is_refused(old: str, new: str) -> None:
    core = flat("zero")
    text, count = re.subn(old, new, core.text)
    assert count == 1
    with pytest.raises(RejectedError):
        core.check(text)
