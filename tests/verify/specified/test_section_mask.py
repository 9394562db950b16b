"""Certificates of filters inside a mask, and those beside it: by a little, by a section, or by zeros that cost time."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from pathlib import Path

import pytest

from sosmith.gen.core import design_core
from sosmith.gen.output.certificate import certificate
from sosmith.gen.specification.specification import from_text
from sosmith.verify.certificate_file import Certificate, SectionEntry
from sosmith.verify.graph import RejectedError
from sosmith.verify.specified.stated_specification import Agreement, check_specification
from sosmith.verify.verification import verify

SPECIFICATION = """
name = "short"
sample_rate = 1000
input.x = { bits = 8, signed = true, range = [-1.0, 1.0] }
output = { bits = 8, signed = true, range = [-1.0, 1.0], max_error = 0.05 }
hardware = { architecture = "parallel", multipliers = 0 }

[filter]
family = "butterworth"
kind = "KIND"
passband_edge = PASSBAND
stopband_edge = STOPBAND
passband_loss = 1.0
stopband_loss = 20.0
freedom = "mask"
"""
BANDS = {
    "lowpass": ("50.0", "120.0"),
    "highpass": ("120.0", "50.0"),
    "bandpass": ("[100.0, 150.0]", "[50.0, 250.0]"),
    "bandstop": ("[50.0, 250.0]", "[100.0, 150.0]"),
}
OUTSIDE = "the filter must keep to the edges and losses of the specification"
TINY = Fraction(1, 10**10)
"""As a share of a gain, less than 1e-9 dB."""


def text_of(kind: str) -> str:
    passband, stopband = BANDS[kind]
    return SPECIFICATION.replace("KIND", kind).replace("PASSBAND", passband).replace("STOPBAND", stopband)


@cache
def certified(kind: str) -> tuple[Certificate, Fraction]:
    design = design_core(from_text(text_of(kind), Path("short.toml")))
    made = certificate(design.quantized, design.spec.max_error)
    return made, verify(made).margin


def with_sections(kind: str, sections: Sequence[SectionEntry]) -> Agreement:
    made, margin = certified(kind)
    ideal = made.ideal.model_copy(update={"sections": tuple(sections)})
    return check_specification(made.model_copy(update={"ideal": ideal}), text_of(kind), margin)


def louder(kind: str, factor: Fraction) -> list[SectionEntry]:
    first, *others = certified(kind)[0].ideal.sections
    numerator = tuple(tap * factor for tap in first.numerator)
    return [SectionEntry(numerator=numerator, denominator=first.denominator), *others]


@pytest.mark.slow
@pytest.mark.parametrize("kind", BANDS)
def test_a_filter_inside_its_mask_is_accepted(kind: str) -> None:
    made, margin = certified(kind)
    assert check_specification(made, text_of(kind), margin) == Agreement("filter", Fraction(0), False, by_losses=True)


def test_a_gain_that_exceeds_its_limit_by_a_little_is_seen() -> None:
    # The gain at 0 Hz is the limit itself.
    assert with_sections("lowpass", louder("lowpass", 1 - TINY)).by_losses
    with pytest.raises(RejectedError, match=f"^{OUTSIDE}$"):
        with_sections("lowpass", louder("lowpass", 1 + TINY))


@pytest.mark.sweep(2)
@pytest.mark.parametrize("kind", BANDS)
def test_sections_that_the_family_does_not_need_are_seen(kind: str) -> None:
    """An all-pass section changes no gain, but the filter."""
    sections = certified(kind)[0].ideal.sections
    order = sum(len(section.denominator) - 1 for section in sections)
    half = Fraction(1, 2)
    passing = SectionEntry(numerator=(half, Fraction(1)), denominator=(Fraction(1), half))
    sentence = f"the filter must have at most {order} poles, as the family's has, not {order + 1}"
    with pytest.raises(RejectedError, match=f"^{sentence}$"):
        with_sections(kind, [*sections, passing])


def test_zeros_that_only_delay_are_seen() -> None:
    *others, last = certified("lowpass")[0].ideal.sections
    late = SectionEntry(numerator=(*[Fraction(0)] * 200, *last.numerator), denominator=last.denominator)
    with pytest.raises(RejectedError, match=r"^the filter must have at most 4 zeros, as the family's has, not 204$"):
        with_sections("lowpass", [*others, late])


def test_a_filter_of_a_lower_order_outside_the_mask_is_seen() -> None:
    with pytest.raises(RejectedError, match=f"^{OUTSIDE}$"):
        with_sections("lowpass", certified("lowpass")[0].ideal.sections[1:])
