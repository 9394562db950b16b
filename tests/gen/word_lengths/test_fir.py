"""Word lengths of FIR filters: the coarsest grid that keeps to the error, and few digits where adders make products."""

from fractions import Fraction

import pytest
from tests.gen.word_lengths.filters import fir_spec

import sosmith
from sosmith.gen.core import design_core
from sosmith.gen.filter.design import design
from sosmith.gen.realizations.registry import FIR
from sosmith.gen.word_lengths.fir import fir_stages
from sosmith.model.dataflow.adder_graph import signed_digits
from sosmith.model.dataflow.graph import Range
from sosmith.model.errors import ShortfallError, SpecificationError

TAPS = ["0.0123", "-0.0456", "0.1789", "0.31", "0.1789", "-0.0456", "0.0123"]
X = Range(0, -1000, 999)


@pytest.mark.parametrize("allowed", [Fraction(1, 4), Fraction(3), Fraction(30)])
def test_one_bit_less_would_exceed_the_error(allowed: Fraction) -> None:
    ideal = design(fir_spec(TAPS), 1000.0)
    (section,), proof = fir_stages(ideal, "fir_symmetric", X, allowed)
    assert proof.coefficients.magnitude <= allowed
    assert proof.rounding.magnitude == 0
    frac = max(frac for _, frac in section.coefficients.values())
    coarser = [abs(Fraction(tap) - Fraction(round(float(tap) * 2 ** (frac - 1)), 2 ** (frac - 1))) for tap in TAPS]
    assert sum(coarser) * 1000 > allowed


def test_the_bound_is_that_of_a_sum_of_magnitudes() -> None:
    ideal = design(fir_spec(TAPS), 1000.0)
    for name in FIR:
        (section,), proof = fir_stages(ideal, name, X, Fraction(2))
        made = {k: Fraction(integer) / 2**frac for k, (integer, frac) in section.coefficients.items()}
        names = ["b0", "b1", "b2", "b3", "b2", "b1", "b0"]
        deviations = [made[k] - Fraction(tap) for k, tap in zip(names, TAPS, strict=True)]
        ends = [sum(max(d * 999, -d * 1000) for d in deviations), sum(max(-d * 999, d * 1000) for d in deviations)]
        assert abs(proof.coefficients.magnitude - max(ends)) < Fraction(1, 2**60)


def test_digits_are_saved_within_the_error() -> None:
    ideal = design(fir_spec(TAPS), 1000.0)
    allowed = Fraction(2)
    (plain,), _ = fir_stages(ideal, "fir_transposed", X, allowed)
    (few,), proof = fir_stages(ideal, "fir_transposed", X, allowed, few_digits=True)
    digits = [sum(len(signed_digits(c)) for c, _ in each.coefficients.values()) for each in (plain, few)]
    assert digits[1] < digits[0]
    assert proof.coefficients.magnitude <= allowed


def test_too_small_an_error_is_refused() -> None:
    ideal = design(fir_spec(["0.1", "0.3"]), 1000.0)
    with pytest.raises(
        ShortfallError,
        match=r"^the filter's coefficients must keep their error below 1e-20 output LSB with 40 bits, and do not: "
        r"raise output\.max_error or raise output\.bits$",
    ):
        fir_stages(ideal, "fir_direct", X, Fraction(1, 10**20))


@pytest.mark.parametrize(
    ("filter_", "realization", "message"),
    [
        (
            {"taps": [0.5, 0.5]},
            "df1",
            "specification: the realization must be auto, fir_direct, fir_symmetric, fir_transposed for an FIR filter, "
            "not df1",
        ),
        (
            {"family": "butterworth", "kind": "lowpass", "order": 1, "cutoff": 100.0},
            "fir_direct",
            "specification: the realization must be auto, df1, df1_ef1, df1_ef2, df2t, delta, state_space, normal, "
            "lattice_wdf for second-order sections, not fir_direct",
        ),
    ],
)
def test_realizations_of_other_filters_are_refused(filter_: dict[str, object], realization: str, message: str) -> None:
    spec = sosmith.Specification.from_taps([0.5, 0.5], 1000.0).replaced(filter=filter_)
    with pytest.raises(SpecificationError) as refused:
        design_core(spec.checked, realization=realization)
    assert str(refused.value) == message


def test_a_symmetric_filter_of_16_taps_takes_8_multipliers_or_one() -> None:
    half = [-0.003, 0.005, 0.012, -0.02, -0.04, 0.06, 0.17, 0.31]
    spec = sosmith.Specification.from_taps(half + half[::-1], 1000.0, input_bits=16)
    parallel, folded = (
        sosmith.design(spec.replaced(hardware={"architecture": name, "start": "zero"}))
        for name in ("parallel", "folded")
    )
    assert parallel.core.architecture.multiplier_blocks == 8
    assert folded.core.architecture.multiplier_blocks == 1
