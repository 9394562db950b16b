"""Specifications with look-ahead and with several samples a clock, for the tests."""

from functools import cache
from pathlib import Path

from tests.gen.designs import EXAMPLES

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.specification.specification import from_text

AUDIO = (EXAMPLES / "audio_lowpass.toml").read_text(encoding="utf-8")


def text(lanes: int = 1, *, pipeline: str = "look-ahead", clock: str = "48.0e6", base: str = AUDIO) -> str:
    """Return a specification for several samples a clock and a pipeline."""
    made = base.replace('architecture = "auto"', f'pipeline = "{pipeline}"\nsamples_per_clock = {lanes}')
    assert made != base
    return made.replace("clock = 48.0e6", f"clock = {clock}")


@cache
def designed(
    lanes: int = 1,
    *,
    pipeline: str = "look-ahead",
    clock: str = "48.0e6",
    order: int = 5,
    multipliers: int | None = None,
) -> CoreDesign:
    asked = text(lanes, pipeline=pipeline, clock=clock).replace("order = 5\n", f"order = {order}\n")
    asked += "" if multipliers is None else f"\nmultipliers = {multipliers}\n"
    return design_core(from_text(asked, Path("audio.toml")))
