"""The exact filter of a certificate has one form: the verifier finds every digit of it in the words."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import cache
from itertools import product
from pathlib import Path

import pytest

from sosmith.gen.core import design_core
from sosmith.gen.filter.design import design
from sosmith.gen.output.certificate import certificate
from sosmith.gen.specification.specification import from_text
from sosmith.verify.bounds.l1_response import UndecidedError
from sosmith.verify.certificate_file import Certificate, SectionEntry
from sosmith.verify.specified import balls, exact_form
from sosmith.verify.specified.exact_form import exact_sections
from sosmith.verify.specified.ideal_filter import stated_filter
from sosmith.verify.specified.stated_specification import check_specification
from sosmith.verify.specified.words import words_of
from sosmith.verify.verification import RejectedError, verify

WORDS = """
name = "plain"
sample_rate = 1000
input.x = { bits = 8, signed = true, range = [-1.0, 1.0] }
output = { bits = 8, signed = true, range = [-1.0, 1.0], unit = "", max_error = 0.05 }
hardware = { realization = "df1_ef2", architecture = "parallel" }
filter = { FILTER }
"""
ELLIPTIC = 'family = "elliptic", kind = "lowpass", order = 3, cutoff = 200.0, passband_loss = 1.0, stopband_loss = 30.0'
ROWS = "sos = [[0.25, 0.1, 0.05, 1, -0.3, 0.1], [1, 0.5, 0, 1, -0.7, 0]]"

LOSSES = {
    "chebyshev1": ", passband_loss = 0.5",
    "chebyshev2": ", stopband_loss = 40.0",
    "elliptic": ", passband_loss = 0.5, stopband_loss = 40.0",
}
FAMILIES = ["butterworth", "chebyshev1", "chebyshev2", "elliptic", "bessel"]
BANDS = {"lowpass": "250.0", "highpass": "1.0", "bandpass": "[200.0, 300.0]", "bandstop": "[10.0, 490.0]"}
BY_ORDER = [
    f'family = "{family}", kind = "{kind}", order = {order}, cutoff = {BANDS[kind]}{LOSSES.get(family, "")}'
    for family, kind, order in product(FAMILIES, BANDS, (1, 4, 7))
]
SAMPLED = [
    f'family = "{family}", kind = "lowpass", order = 3, cutoff = 100.0, method = "impulse_invariant"'
    f"{LOSSES.get(family, '')}"
    for family in FAMILIES
]
EDGES = [
    'family = "elliptic", kind = "bandstop", passband_edge = [60.0, 270.0], stopband_edge = [100.0, 200.0], '
    "passband_loss = 0.5, stopband_loss = 40.0"
]
GIVEN = ["sos = [[1, 2, 1, 1, -0.8, 0.15]]", "sos = [[0.1, 0, 0, 1, 0, 0.25], [1, 0, 0, 1, 0, 0]]", ROWS]


@pytest.mark.sweep(20)
@pytest.mark.parametrize("words", [*SAMPLED, *EDGES, *GIVEN, *BY_ORDER])
def test_the_verifier_finds_the_digits_of_the_design(words: str) -> None:
    text = WORDS.replace("FILTER", words)
    spec, tree = from_text(text, Path("spec.toml")), words_of(text)
    assert spec.filter is not None
    found = exact_sections(stated_filter(tree["filter"], Fraction(tree["sample_rate"])))
    assert [(section.numerator, section.denominator) for section in found] == list(
        design(spec.filter, spec.sample_rate).exact
    )


@cache
def certified(words: str) -> tuple[Certificate, Fraction, str]:
    text = WORDS.replace("FILTER", words)
    made = design_core(from_text(text, Path("spec.toml")))
    found = certificate(made.quantized, made.spec.max_error)
    return found, verify(found).margin, text


Sections = tuple[SectionEntry, ...]


def held(words: str, edit: Callable[[Sections], Sections] = lambda sections: sections) -> None:
    made, margin, text = certified(words)
    other = made.ideal.model_copy(update={"sections": edit(made.ideal.sections)})
    check_specification(made.model_copy(update={"ideal": other}), text, margin)


def nudged(section: int, name: str, k: int, by: Fraction) -> Callable[[Sections], Sections]:
    """Return an edit that adds to one coefficient."""

    def edit(sections: Sections) -> Sections:
        taps = list(getattr(sections[section], name))
        taps[k] += by
        changed = sections[section].model_copy(update={name: tuple(taps)})
        return (*sections[:section], changed, *sections[section + 1 :])

    return edit


def scaled(sections: Sections) -> Sections:
    """Let two sections share the gain in another way."""
    first, second, *others = sections
    one, other = (
        section.model_copy(update={"numerator": tuple(tap * factor for tap in section.numerator)})
        for section, factor in ((first, Fraction(2)), (second, Fraction(1, 2)))
    )
    return (one, other, *others)


UNIT = Fraction(1, 2**220)
"""Far below the grid of any claim."""
ONE = SectionEntry(numerator=(Fraction(1),), denominator=(Fraction(1),))
OTHERS: dict[str, Callable[[Sections], Sections]] = {
    "in another order": lambda sections: sections[::-1],
    "an empty section more": lambda sections: (*sections, ONE),
    "the gain elsewhere": scaled,
}


@pytest.mark.parametrize("words", [ELLIPTIC, ROWS])
def test_no_digit_is_free(words: str) -> None:
    """Each digit was free as long as the claims held for the other filter as well."""
    held(words)
    sections = certified(words)[0].ideal.sections
    for k, section in enumerate(sections):
        for name in ("numerator", "denominator"):
            for place in range(name == "denominator", len(getattr(section, name))):
                for by in (UNIT, -UNIT, UNIT / 2**100, Fraction(1, 3 * 2**300)):
                    sentence = f"^the {name} of section {k} of the exact filter must have the digits that follow from"
                    with pytest.raises(RejectedError, match=sentence):
                        held(words, nudged(k, name, place, by))


@pytest.mark.parametrize("edit", OTHERS)
def test_the_sections_have_one_order_and_one_gain(edit: str) -> None:
    with pytest.raises(RejectedError, match=r"of the exact filter must have|^the exact filter must have \d sections"):
        held(ELLIPTIC, OTHERS[edit])


def test_more_digits_than_there_are_to_be_are_other_digits(monkeypatch: pytest.MonkeyPatch) -> None:
    """A certificate that states the filter to a bit more is refused."""
    monkeypatch.setattr(exact_form, "_SPARE_BITS", 193)
    with pytest.raises(RejectedError, match=r"must have the digits that follow from the words$"):
        held(ELLIPTIC)


def test_a_number_between_two_is_not_decided(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(balls, "_FIRST_PRECISION", 64)
    monkeypatch.setattr(balls, "_MAX_PRECISION", 64)
    with pytest.raises(UndecidedError, match=r"^the exact filter could not be rounded$"):
        exact_sections(stated_filter({"family": "bessel", "kind": "lowpass", "order": 3, "cutoff": 1}, Fraction(10)))
