"""Formats and coefficients: the integer model against the golden chain, over examples and many designs."""

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy import signal
from tests.gen.designs import ALL, example_design, with_rows
from tests.gen.word_lengths.filters import OUT, SIGNED, butterworth, errors, plain, stimulus

from sosmith.gen.filter.design import Filter, design
from sosmith.gen.realizations.registry import CASCADES, SECTIONS
from sosmith.gen.specification.specification import FilterSpec
from sosmith.gen.word_lengths.other_realization import with_realization
from sosmith.gen.word_lengths.quantize import quantize
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port


def given(*rows: Sequence[str]) -> Filter:
    """Filter of sections given as decimal numbers."""
    return design(
        FilterSpec(
            family="sections",
            kind="sections",
            method="sections",
            order=None,
            cutoff=None,
            passband_edge=None,
            stopband_edge=None,
            passband_loss=None,
            stopband_loss=None,
            sos=tuple(tuple(map(Fraction, row)) for row in rows),
        ),
        Fraction(1),
    )


def case(name: str, realization: str) -> Any:
    """Pair an example with a realization; the locomotive takes long in all but one."""
    long = "locomotive" in name and realization != "df1_ef2"
    return pytest.param(name, realization, marks=[pytest.mark.slow] if long else [])


@pytest.mark.sweep(1)
@pytest.mark.parametrize(("name", "realization"), [case(*each) for each in product(ALL, SECTIONS)])
def test_examples_stay_within_their_bound(name: str, realization: str) -> None:
    design = example_design(name, realization=realization)
    quantized = design.quantized
    assert quantized.bound * quantized.datapath.output.lsb <= design.spec.max_error
    found = np.abs(errors(quantized, stimulus(quantized.datapath.inputs, 1))).max()
    assert 0.4 < found <= quantized.bound


DESIGNS = [
    (kind, order, cutoff)
    for kind in ("lowpass", "highpass", "bandpass", "bandstop")
    for order in (1, 2, 3, 6)
    for cutoff in (0.0026, 0.03, 0.2, 0.36)
]

LONG = {wanted for wanted in DESIGNS if wanted[1] == 6} | {("bandpass", 3, 0.0026), ("bandstop", 3, 0.0026)}
"""Designs that the fast tests leave out."""

CASES = [
    pytest.param(*wanted, realization, marks=[] if in_turn and wanted not in LONG else [pytest.mark.slow])
    for i, wanted in enumerate(DESIGNS)
    for k, realization in enumerate(CASCADES)
    if (in_turn := (i + k) % len(CASCADES) == 0) or not (wanted[0].startswith("band") and wanted[1:] == (6, 0.0026))
]
"""All designs in all realizations that take any; the fast tests take each design in one, in turn. So do the slow ones
with twelve poles next to z = 1, whose peak gains take minutes a design."""


@pytest.mark.sweep(2)
@pytest.mark.parametrize(("kind", "order", "cutoff", "realization"), CASES)
def test_designs_stay_within_their_bound(kind: str, order: int, cutoff: float, realization: str) -> None:
    quantized = plain(butterworth(order, cutoff, kind), realization)
    codes = stimulus(quantized.datapath.inputs, order)
    assert np.abs(errors(quantized, codes)).max() <= quantized.bound <= 1
    quantized.datapath.compute_exact(codes[6000:9000])  # raises if a value leaves its range


@pytest.mark.slow
@pytest.mark.parametrize("core", ["filter", "calibration", "instrument"])
def test_parts_of_the_instrument(core: str) -> None:
    quantized = example_design("flange_wear_bench.toml", core=core).quantized
    codes = stimulus(quantized.datapath.inputs, 4)
    assert np.abs(errors(quantized, codes)).max() <= quantized.bound <= 1
    assert (quantized.filter is None, quantized.polynomial is None) == (core == "calibration", core == "filter")
    assert quantized.datapath.compute(codes[:2000]).tolist() == quantized.datapath.compute_exact(codes[:2000])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("inputs", "output"),
    [
        (Port.from_range("x", 12, Fraction(-5), Fraction(5), signed=True), OUT),
        (Port.from_range("x", 14, Fraction(0), Fraction(33, 10)), Port.from_range("y", 18, Fraction(-1), Fraction(4))),
        (Port.from_range("x", 10, Fraction(4), Fraction(20)), Port.from_range("y", 16, Fraction(4), Fraction(20))),
        (SIGNED, Port.from_range("y", 8, Fraction(-1, 2), Fraction(1, 2), signed=True)),
    ],
)
def test_any_input_and_output_range(inputs: Port, output: Port) -> None:
    """Ranges whose steps are no powers of two of each other, offsets, and an output that saturates."""
    quantized = plain(butterworth(3, 0.05), inputs=inputs, output=output)
    codes = stimulus(quantized.datapath.inputs, 8)
    assert np.abs(errors(quantized, codes)).max() <= quantized.bound <= 1
    assert quantized.datapath.compute(codes[:2000]).tolist() == quantized.datapath.compute_exact(codes[:2000])


@pytest.mark.slow
def test_two_products_make_a_low_pass_section() -> None:
    quantized = plain(butterworth(5, 0.02))
    assert [len(section.products) for section in quantized.sections] == [1, 2, 2]
    assert all(sum(s.numerator) == 1 + sum(s.denominator) for s in quantized.sections)


@pytest.mark.slow
def test_feedback_without_new_widths() -> None:
    """Plain direct form at the widths of df1_ef2 falls short by orders of magnitude; that is the point of it."""
    before = example_design("flange_wear_locomotive.toml").quantized
    after = with_realization(before, "df1")
    for ours, theirs in zip(after.sections, before.sections, strict=True):
        assert [replace(p, range=None) for p in ours.products] == [replace(p, range=None) for p in theirs.products]
    assert [s.y_frac for s in after.sections] == [s.y_frac for s in before.sections]
    assert {s.feedback for s in after.sections} == {(0, 0)}
    codes = stimulus(before.datapath.inputs, 2)
    assert np.abs(errors(before, codes)).max() <= before.bound
    assert 20 < np.abs(errors(after, codes)).max() <= after.bound
    after.datapath.compute_exact(codes[:20000])


@pytest.mark.slow
def test_given_sections_of_an_elliptic_filter() -> None:
    sos = signal.ellip(6, 0.2, 60, 0.01, fs=1.0, output="sos")
    ideal = with_rows(butterworth(2, 0.1), sos)
    quantized = plain(ideal)
    assert np.abs(errors(quantized, stimulus((SIGNED,), 5))).max() <= quantized.bound <= 1


INTEGER_ROWS = {
    "pass": (1.0, 0.0, 0.0, 1.0, 0.0, 0.0),
    "delay": (0.0, 0.0, 1.0, 1.0, 0.0, 0.0),
    "slope": (2.0, -1.0, 0.0, 1.0, 0.0, 0.0),
}


@pytest.mark.slow
@pytest.mark.parametrize("realization", CASCADES)
@pytest.mark.parametrize("name", INTEGER_ROWS)
def test_a_section_of_whole_numbers_rounds_nothing(name: str, realization: str) -> None:
    """What it passes on has the fraction bits of the section before it; a quantizer of its own would have none."""
    first, last = butterworth(2, 0.05).rows[0], butterworth(2, 0.1).rows[0]
    quantized = plain(with_rows(butterworth(2, 0.1), [first, INTEGER_ROWS[name], last]), realization)
    codes = stimulus((SIGNED,), 6)
    assert np.abs(errors(quantized, codes)).max() <= quantized.bound <= 1
    assert quantized.datapath.compute(codes[6500:8500]).tolist() == quantized.datapath.compute_exact(codes[6500:8500])


@pytest.mark.slow
def test_a_state_that_copies_another_keeps_all_its_bits() -> None:
    """In normal form a real pole and two zeros make a second state that is the first one, a sample ago."""
    ideal = with_rows(butterworth(2, 0.1), [(0.25, 0.1, 0.25, 1.0, -0.4, 0.0), butterworth(2, 0.1).rows[0]])
    quantized = plain(ideal, "normal")
    assert np.abs(errors(quantized, stimulus((SIGNED,), 7))).max() <= quantized.bound <= 1


def test_polynomial_of_higher_order() -> None:
    polynomial = Polynomial.from_numbers([["0.5", "-0.01", "0.0002"], ["0.3", "0.001"], ["0.02"], ["0.003", "0.00001"]])
    inputs = (
        Port.from_range("voltage", 16, Fraction(0), Fraction(10)),
        Port.from_range("temperature", 12, Fraction(-40), Fraction(215)),
    )
    output = Port.from_range("d", 16, Fraction(-8), Fraction(24))
    quantized = quantize(
        name="p",
        inputs=inputs,
        output=output,
        max_error=output.lsb,
        ideal=None,
        polynomial=polynomial,
        realization="df1_ef2",
    )
    codes = np.random.default_rng(3).integers(0, [65536, 4096], (20000, 2))
    assert np.abs(errors(quantized, codes)).max() <= quantized.bound <= 1


LOWPASS = ("0.1", "0", "0", "1", "-0.9", "0")
ONE_LATER, TWO_LATER = ("0", "1", "0", "1", "0", "0"), ("0", "0", "1", "1", "0", "0")


@pytest.mark.sweep(3)
@pytest.mark.parametrize("realization", CASCADES)
@pytest.mark.parametrize(
    "rows",
    [
        (TWO_LATER,),
        (LOWPASS, ONE_LATER),
        (LOWPASS, ("2", "-1", "0", "1", "0", "0")),
        (("0.3", "0.3", "0.3", "1", "-0.1", "0"),),
    ],
)
def test_quantizers_with_nothing_to_drop_until_there_are_fraction_bits_before_them(
    rows: Sequence[Sequence[str]], realization: str
) -> None:
    quantized = plain(given(*rows), realization)
    assert quantized.bound <= 1
    worst = np.abs(errors(quantized, stimulus(quantized.datapath.inputs, 1, 4000))).max()
    assert worst <= float(quantized.bound) + 1e-9


def test_given_sections_keep_their_gain() -> None:
    """One part in 10**9 is half an LSB of 30 bits: what is given is meant."""
    (row,) = given(("0.5000000004", "0.5000000004", "0", "1", "0", "0")).rows
    assert row[:3] == pytest.approx((0.5000000004, 0.5000000004, 0), rel=1e-15)
