"""One filter in each architecture."""

from dataclasses import replace
from fractions import Fraction

from tests.gen.designs import EXAMPLES

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.specification.specification import load


def design_in(
    architecture: str, example: str = "audio_lowpass.toml", *, clock: int = 100_000_000, start: str = "zero"
) -> CoreDesign:
    spec = load(EXAMPLES / example)
    hardware = replace(
        spec.hardware, architecture=architecture, clock=Fraction(clock), realization="df1_ef2", start=start
    )
    return design_core(replace(spec, hardware=hardware))
