"""A certificate against the words of its specification: every word that counts is compared."""

from __future__ import annotations

import re
from fractions import Fraction
from functools import cache
from pathlib import Path

import pytest
from tests.gen.designs import EXAMPLES, example_design

from sosmith.gen.core import design_core
from sosmith.gen.output.certificate import certificate
from sosmith.gen.specification.specification import from_text
from sosmith.verify.certificate_file import Certificate
from sosmith.verify.specified.stated_specification import Agreement, check_specification
from sosmith.verify.verification import RejectedError, verify

BENCH, AUDIO = "flange_wear_bench.toml", "audio_lowpass.toml"

EDGES = """
name = "edges"
sample_rate = 1000
[input.x]
bits = 8
range = [-1.0, 1.0]
signed = true
[filter]
family = "FAMILY"
kind = "KIND"
passband_edge = PASSBAND
stopband_edge = STOPBAND
passband_loss = 1.0
stopband_loss = 20.0
[output]
bits = 8
range = [-1.0, 1.0]
signed = true
max_error = 0.02
[hardware]
realization = "df1"
architecture = "parallel"
"""


@cache
def certified(name: str, core: str | None = None) -> tuple[Certificate, Fraction]:
    """Certify an example; return the certificate and the margin that its proof leaves."""
    design = example_design(name, realization="df1_ef2" if core != "calibration" else None, core=core)
    made = certificate(design.quantized, design.spec.max_error)
    return made, verify(made).margin


def text_of(name: str) -> str:
    return (EXAMPLES / name).read_text(encoding="utf-8")


def agreed(name: str, text: str, core: str | None = None) -> Agreement:
    made, margin = certified(name, core)
    return check_specification(made, text, margin)


@pytest.mark.parametrize("core", ["instrument", "filter", "calibration"])
def test_every_core_of_an_example_is_as_specified(core: str) -> None:
    found = agreed(BENCH, text_of(BENCH), core)
    assert (found.core, found.fitted) == (core, False)
    assert (found.distance is None) == (core == "calibration")
    if found.distance is not None:
        assert 0 < found.distance < Fraction(1, 2**150)


CHANGES = [
    (
        BENCH,
        'name = "flange_wear_bench"',
        'name = "other"',
        "the name must be other as specified, not flange_wear_bench",
    ),
    (
        BENCH,
        "range = [0.0, 10.0]",
        "range = [0.0, 10.1]",
        "lsb of voltage must be 101/655360 as specified, not 5/32768",
    ),
    (BENCH, "range = [0.0, 10.0]", "range = [0.1, 10.1]", "zero of voltage must be 1/10 as specified, not 0"),
    (BENCH, "bits = 16\nrange = [0.0, 10.0]", "bits = 15\nrange = [0.0, 10.0]", "bits of voltage must be 15 as"),
    (BENCH, "range = [0.0, 128.0]", "range = [0.0, 127.0]", "lsb of temperature must be 127/65536 as specified"),
    (BENCH, "range = [0.0, 16.0]", "range = [0.0, 17.0]", "lsb of clearance must be 17/65536 as specified"),
    (BENCH, 'unit = "mm"', 'unit = "m"', "unit of clearance must be m as specified, not mm"),
    (BENCH, 'max_error = "faithful"', "max_error = 0.0005", "max_error must be 1/2000 as specified, not 1/4096"),
    (BENCH, "-0.0036]", "-0.0037]", "coefficient [0][1] of the calibration must be -37/10000 as specified"),
    (
        BENCH,
        "[0.05812]]",
        "[0.05812, 1e-9]]",
        "coefficient [2][1] of the calibration must be 1/1000000000 as specified",
    ),
    (BENCH, ", [0.05812]]", "]", "coefficient [2][0] of the calibration must be 0 as specified, not 1453/25000"),
    (AUDIO, "signed = true                   #", "signed = false                  #", "signed of x must be False as"),
]
FILTERS = [
    ('family = "butterworth"', 'family = "bessel"'),
    ('kind = "lowpass"', 'kind = "highpass"'),
    ('method = "bilinear"', 'method = "impulse_invariant"'),
    ("order = 5", "order = 4"),
    ("cutoff = 0.5751308 ", "cutoff = 0.57513080000001 "),
    ("sample_rate = 6.0 ", "sample_rate = 6.0000000000001 "),
]


@pytest.mark.parametrize(("name", "old", "new", "sentence"), CHANGES)
def test_another_word_is_rejected(name: str, old: str, new: str, sentence: str) -> None:
    text = text_of(name)
    assert text.count(old) == 1
    with pytest.raises(RejectedError, match=f"^{re.escape(sentence)}"):
        agreed(name, text.replace(old, new))


@pytest.mark.parametrize(("old", "new"), FILTERS)
def test_another_filter_is_rejected(old: str, new: str) -> None:
    text = text_of(BENCH)
    assert text.count(old) == 1
    pattern = r"^the filter must be the specified one within a peak gain of [0-9.e-]+, not differ from it by up to .*$"
    with pytest.raises(RejectedError, match=pattern):
        agreed(BENCH, text.replace(old, new))


def test_a_calibration_that_is_not_specified_is_rejected() -> None:
    text = re.sub(r"\[calibration\].*?(?=\[filter\])", "", text_of(BENCH), flags=re.DOTALL)
    with pytest.raises(RejectedError, match=r"^name of y|^unit of voltage must be mm as specified, not V$"):
        agreed(BENCH, text)


@pytest.mark.parametrize(
    "text", ["", "name = 5", text_of(AUDIO).replace("[filter]", "[filters]"), "not TOML", text_of(AUDIO)[:300]]
)
def test_what_is_no_whole_specification_is_rejected(text: str) -> None:
    with pytest.raises(RejectedError, match=r"^(the specification|the name) must be "):
        agreed(AUDIO, text)


@pytest.mark.slow
@pytest.mark.parametrize("family", ["butterworth", "chebyshev1", "chebyshev2", "elliptic"])
@pytest.mark.parametrize(
    ("kind", "passband", "stopband", "other"),
    [
        ("lowpass", "100.0", "150.0", "151.0"),
        ("bandpass", "[100.0, 150.0]", "[80.0, 190.0]", "[79.0, 190.0]"),
        ("bandstop", "[80.0, 190.0]", "[100.0, 150.0]", "[101.0, 150.0]"),
    ],
)
def test_a_filter_by_its_edges(family: str, kind: str, passband: str, stopband: str, other: str) -> None:
    text = EDGES.replace("FAMILY", family).replace("KIND", kind).replace("PASSBAND", passband)
    design = design_core(from_text(text.replace("STOPBAND", stopband), Path("edges.toml")))
    made = certificate(design.quantized, design.spec.max_error)
    margin = verify(made).margin
    assert check_specification(made, text.replace("STOPBAND", stopband), margin).distance < margin
    loss = text.replace("STOPBAND", stopband).replace("passband_loss = 1.0", "passband_loss = 1.0000001")
    if family != "chebyshev2" or kind != "bandstop":  # whose stop edges alone set it, and are met exactly
        with pytest.raises(RejectedError, match=r"^the filter must be the specified one within"):
            check_specification(made, loss, margin)


def test_given_sections_are_taken_as_they_are_written() -> None:
    """As decimal numbers: the doubles nearest to them are another filter."""
    head, _, tail = text_of(AUDIO).partition("[filter]")
    rest = tail[tail.index("[output]") :]
    words = "[filter]\nsos = [[0.1, 0.2, 0.1, 1.0, -1.1, 0.5]]\n"
    design = design_core(from_text(head + words + rest, Path("given.toml")), realization="df1")
    made = certificate(design.quantized, design.spec.max_error)
    margin = verify(made).margin
    found = check_specification(made, head + words + rest, margin).distance
    assert found is not None
    assert 0 < found < Fraction(1, 2**180)
    with pytest.raises(RejectedError, match=r"^the filter must be the specified one within"):
        check_specification(made, head + words.replace("-1.1", "-1.1000000000000001") + rest, margin)


@pytest.mark.parametrize("taps", [[0.1, 0.4, 0.1], [0.2, 0.3, 0.1]])
def test_decimal_taps_over_a_range_of_a_multiple_of_five_lsb(taps: list[float]) -> None:
    """Errors are then multiples of the grid of the claims, but for the rounding of the taps to rationals."""
    text = f"""
name = "smooth"
sample_rate = 1000.0
input.x = {{ bits = 8, range = [-1.0, 1.0], signed = true }}
filter = {{ taps = {taps} }}
output = {{ bits = 12, range = [-2.0, 2.0], signed = true }}
hardware = {{ architecture = "parallel" }}
"""
    made = design_core(from_text(text, Path("smooth.toml")))
    read = certificate(made.quantized, made.spec.max_error)
    agreement = check_specification(read, text, verify(read).margin)
    assert agreement.distance is not None
    assert 0 < agreement.distance < Fraction(1, 2**128)
