"""Realizations df2t and delta: exact transfer functions, bit-exact equivalents, many designs, scaling, refusals."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import NamedTuple

import numpy as np
import pytest
from scipy import signal
from tests.gen.designs import with_rows
from tests.gen.proven_stages import Ranges, datapath_of, proven_cascade
from tests.gen.word_lengths.filters import butterworth, errors, plain, stimulus
from tests.hdl.stages.stage_bench import run as run_hardware

from sosmith.gen.proof.linear_model import linear_model
from sosmith.gen.realizations.coefficients import Rounding
from sosmith.gen.realizations.direct_form import direct_form
from sosmith.gen.realizations.registry import REALIZATIONS
from sosmith.gen.realizations.section_format import WIDE, SectionFormat
from sosmith.gen.realizations.transposed import transposed_form
from sosmith.model.dataflow.graph import Range
from sosmith.model.dataflow.structure import Stage
from sosmith.model.errors import ShortfallError
from sosmith.model.port import Port
from sosmith.model.sections.direct_form import DirectForm1
from sosmith.model.sections.transposed_form import TransposedForm

INPUT = Port.from_range("x", 16, -1, 1, signed=True)
Row = tuple[float, ...]


class Design(NamedTuple):
    """A filter to be built twice: with its sections' coefficient width and fraction bits of every output."""

    rows: tuple[Row, ...]
    bits: int
    frac: int


def rows_of(sos: np.ndarray) -> tuple[Row, ...]:
    """Sections of unity gain at zero frequency: the coefficients of both realizations are then the same."""
    return tuple((*(row[:3] * row[3:].sum() / row[:3].sum()), *row[3:]) for row in sos)


DESIGNS = [
    Design(rows_of(sos), bits, frac)
    for sos, bits, frac in (
        (signal.butter(1, 0.001, fs=1.0, output="sos"), 12, 4),
        (signal.butter(2, 0.001, fs=1.0, output="sos"), 18, 3),
        (signal.butter(7, 0.002588, fs=1.0, output="sos"), 18, 5),
        (signal.butter(5, 1000 / 48000, fs=1.0, output="sos"), 16, 6),
        (signal.butter(4, 0.1, fs=1.0, output="sos"), 9, 2),
        (signal.butter(10, 0.05, fs=1.0, output="sos"), 20, 8),
        (signal.cheby1(5, 1, 0.01, fs=1.0, output="sos"), 14, 0),
        (signal.cheby1(8, 0.1, 0.03, fs=1.0, output="sos"), 17, 7),
        (signal.cheby2(6, 50, 0.02, fs=1.0, output="sos"), 19, 5),
        (signal.cheby2(5, 40, 0.05, fs=1.0, output="sos"), 12, 4),
        (signal.ellip(7, 0.5, 60, 0.02, fs=1.0, output="sos"), 21, 6),
        (signal.ellip(4, 1, 50, 0.04, fs=1.0, output="sos"), 15, 3),
        (signal.bessel(6, 0.01, fs=1.0, output="sos"), 18, 5),
    )
]


Make = Callable[[Row, Design, Range, Ranges], Stage]


def exact_delta(row: Row, design: Design, x: Range, ranges: Ranges) -> TransposedForm:
    """Make the section in delta form with states that keep all their bits."""
    return transposed_form(
        row,
        name="section",
        delta=True,
        rounding=Rounding(design.bits),
        x=x,
        fracs={"v": design.frac},
        ranges=ranges,
        wide=(-WIDE, WIDE),
    )


def error_feedback(row: Row, design: Design, x: Range, ranges: Ranges) -> DirectForm1:
    """Make the section as df1_ef2 with the error feedback (-2, 1), or (-1, 0) at first order, also where Q is low."""
    section = direct_form(
        row,
        name="section",
        feedback_order=2,
        rounding=Rounding(design.bits),
        x=x,
        fracs={"v": design.frac},
        ranges={name: limits for name, limits in ranges.items() if name == "v"},
        wide=(-WIDE, WIDE),
    )
    return replace(section, feedback=section.integer_part)


def sections(make: Make, design: Design) -> list[Stage]:
    return proven_cascade([partial(make, row, design) for row in design.rows], INPUT)


def full_scale(samples: int) -> np.ndarray:
    """Noise, both rails, small steps, and noise again."""
    rng = np.random.default_rng(samples)
    codes = rng.integers(INPUT.lowest, INPUT.highest + 1, samples)
    for part, level in enumerate((INPUT.highest, INPUT.lowest, 1, -1, 0), start=1):
        codes[samples * part // 8 : samples * (part + 1) // 8] = level
    return codes


@pytest.mark.sweep(2)
@pytest.mark.parametrize("design", DESIGNS)
def test_delta_with_exact_states_is_second_order_error_feedback(design: Design) -> None:
    """THEORY 3.5, bit for bit in the compiled model; and in the interpreter, which checks all ranges."""
    delta, direct = (sections(make, design) for make in (exact_delta, error_feedback))
    for ours, theirs in zip(delta, direct, strict=True):
        assert isinstance(ours, TransposedForm)
        assert isinstance(theirs, DirectForm1)
        assert ours.state_fracs == (None, None)
        assert ours.products == tuple(replace(product, range=None) for product in theirs.products)
    codes = full_scale(200_000).reshape(-1, 1)
    one, other = (datapath_of(stages, INPUT) for stages in (delta, direct))
    assert np.array_equal(one.compute(codes), other.compute(codes))
    few = np.concatenate([codes[:300], codes[25_000:25_200]])
    assert one.compute_exact(few) == other.compute_exact(few)


@pytest.mark.sweep(1)
@pytest.mark.parametrize("design", DESIGNS[1:9:2])
def test_hardware_of_delta_with_exact_states_is_second_order_error_feedback(design: Design) -> None:
    samples = full_scale(160).reshape(-1, 1).tolist()
    for ours, theirs in zip(*(sections(make, design) for make in (exact_delta, error_feedback)), strict=True):
        expected = theirs.graph.run(samples)
        assert run_hardware(ours, samples, 1) == run_hardware(theirs, samples, 2) == expected
        samples = expected


@pytest.mark.parametrize("bits", [6, 20])
@pytest.mark.parametrize("realization", ["df2t", "delta"])
@pytest.mark.parametrize("kind", ["lowpass", "highpass", "bandpass", "bandstop"])
@pytest.mark.parametrize("cutoff", [0.0026, 0.36])
def test_transfer_function_is_exactly_that_of_the_direct_form(
    kind: str, cutoff: float, realization: str, bits: int
) -> None:
    for order in (1, 2):
        for row in butterworth(order, cutoff, kind).rows:
            try:
                stage = REALIZATIONS[realization].build(row, SectionFormat(coefficient_bits=bits), "section")
            except ShortfallError:
                assert bits == 6  # unstable
                continue
            assert isinstance(stage, TransposedForm)
            ours, theirs = (linear_model(section.graph) for section in (stage, stage.direct))
            assert trimmed(ours.denominator) == trimmed((1, *stage.direct.denominator))
            assert ours.denominator == theirs.denominator
            assert ours.transfer == theirs.transfer


def trimmed(values: Sequence[Fraction | int]) -> tuple[Fraction | int, ...]:
    return tuple(values[: 1 + max(k for k, value in enumerate(values) if value)])


@pytest.mark.sweep(1)
@pytest.mark.parametrize("realization", ["df2t", "delta"])
def test_gain_at_zero_frequency_is_exactly_one(realization: str) -> None:
    quantized = plain(butterworth(5, 0.02), realization)
    for section in quantized.sections:
        model = linear_model(section.graph)
        assert sum(model.transfer) == sum(model.denominator)


@pytest.mark.parametrize("realization", ["df2t", "delta"])
def test_coefficients_of_a_high_pass_are_small_about_its_poles(realization: str) -> None:
    """Although its gain is one on the other side: there, A1 and A2 near 4 would need ten more bits."""
    (row,) = butterworth(2, 0.0026, "highpass").rows
    stage = REALIZATIONS[realization].build(row, SectionFormat(coefficient_bits=20), "section")
    assert isinstance(stage, TransposedForm)
    found = {product.name: float(product.value) for product in stage.products}
    assert found == pytest.approx({"A1": 2 + row[4], "A2": 1 + row[4] + row[5], "b0": row[0]}, rel=1e-5)


@pytest.mark.parametrize(
    ("kind", "cutoff", "operator"),
    [("lowpass", 0.001, 1), ("lowpass", 0.01, 1), ("lowpass", 0.1, 1), ("highpass", 0.49, -1)],
)
def test_delta_gives_both_states_the_same_scale(kind: str, cutoff: float, operator: int) -> None:
    """Their rms values for white input are within a factor of two of each other."""
    (row,) = butterworth(2, cutoff, kind).rows
    stage = REALIZATIONS["delta"].build(row, SectionFormat(coefficient_bits=30), "section")
    assert isinstance(stage, TransposedForm)
    assert stage.operator == operator
    model = linear_model(stage.graph)
    a = [float(value) for value in model.denominator]
    impulse = np.zeros(20_000)
    impulse[0] = 1
    sizes = {}
    for index in model.bounds:
        b = [float(value) for value in model.sources[0].numerators[index]]
        sizes[stage.graph.nodes[index].name] = np.sqrt(np.sum(signal.lfilter(b, a, impulse) ** 2))
    assert 0.5 < sizes["t1"] / sizes["t2"] < 2


@pytest.mark.sweep(2)
@pytest.mark.parametrize("realization", ["df2t", "delta"])
@pytest.mark.parametrize("row", [(0.0, 0.02, 0.01, 1.0, -1.8, 0.83), (0.0, 0.05, 0.0, 1.0, -0.95, 0.0)])
def test_output_without_the_newest_input(row: Row, realization: str) -> None:
    """With b0 = 0 the output is a state, quantized only once."""
    quantized = plain(with_rows(butterworth(2, 0.1), [row]), realization)
    (section,) = quantized.sections
    names = [source.name for source in linear_model(section.graph).sources]
    assert "v" not in names
    assert "t1" in names
    codes = stimulus((INPUT,), 6)
    assert np.abs(errors(quantized, codes)).max() <= quantized.bound <= 1
    quantized.datapath.compute_exact(codes[6000:9000])


@pytest.mark.slow
@pytest.mark.parametrize("realization", ["df2t", "delta"])
@pytest.mark.parametrize(
    "row",
    [
        (0.5, 0.5, 0.0, 1.0, -1e-17, 0.0),
        (1.0, 0.0, 0.0, 1.0, 0.0, 0.3),
        (2.0, -1.0, 0.0, 1.0, -0.7, 0.0),
    ],
)
def test_coefficients_that_are_small_integers(row: Row, realization: str) -> None:
    """A sum that has no bits to drop while every other quantizer drops all may have some when they do not."""
    fractional = butterworth(2, 0.05).rows[0]
    quantized = plain(with_rows(butterworth(2, 0.1), [fractional, row]), realization)
    codes = stimulus((INPUT,), 6)
    assert np.abs(errors(quantized, codes)).max() <= quantized.bound <= 1
    quantized.datapath.compute_exact(codes[6000:9000])


@pytest.mark.parametrize("realization", ["df2t", "delta"])
def test_coefficients_that_round_to_an_unstable_section_are_refused(realization: str) -> None:
    row = (0.025, 0.05, 0.025, 1.0, -1.899, 0.999)
    with pytest.raises(
        ShortfallError,
        match=r"^section must be stable with coefficients of 2 bits: poles must lie inside the unit circle, "
        r"not at a1 = .*, a2 = .*$",
    ):
        REALIZATIONS[realization].build(row, SectionFormat(coefficient_bits=2), "section")
