"""Designs that cannot be: each refused in one sentence that says what is in the way and what would help."""

import re
from dataclasses import replace
from fractions import Fraction

import pytest
from tests.gen.designs import with_rows
from tests.gen.word_lengths.filters import OUT, SIGNED, butterworth, plain

from sosmith.gen.filter.design import Filter
from sosmith.gen.realizations.registry import CASCADES, REALIZATIONS, Row
from sosmith.gen.realizations.section_format import SectionFormat
from sosmith.gen.word_lengths.quantize import quantize
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port

EIGHT_BITS = Port.from_range("y", 8, Fraction(-1), Fraction(1), signed=True)


def refused(
    sentence: str,
    *,
    beyond_half: Fraction,
    ideal: Filter | None,
    polynomial: Polynomial | None = None,
    realization: str = "df1_ef2",
    output: Port = OUT,
) -> None:
    """Design with `beyond_half` of an LSB beside the output rounding, and expect `sentence`."""
    inputs = (SIGNED,) if polynomial is None else (SIGNED, SIGNED)
    with pytest.raises(ShortfallError, match=f"^{re.escape(sentence)}$"):
        quantize(
            name="refused",
            inputs=inputs,
            output=output,
            max_error=output.lsb * (Fraction(1, 2) + beyond_half),
            ideal=ideal,
            polynomial=polynomial,
            realization=realization,
        )


def test_coefficients_at_a_low_cutoff() -> None:
    refused(
        "the filter's coefficients must keep their error below 5e-10 output LSB with 40 significant bits each, and do "
        "not: raise output.max_error, raise output.bits or decimate by 32 first, as the cutoff is 1/1000 of the sample "
        "rate",
        beyond_half=Fraction(1, 10**9),
        ideal=butterworth(2, 0.001),
    )


def test_coefficients_where_decimation_does_not_help() -> None:
    refused(
        "the filter's coefficients must keep their error below 5e-13 output LSB with 40 significant bits each, and do "
        "not: raise output.max_error or raise output.bits",
        beyond_half=Fraction(1, 10**12),
        ideal=butterworth(3, 0.02, "highpass"),
    )


def test_rounding_at_a_low_cutoff() -> None:
    refused(
        "the filter must keep its rounding error below 5e-09 output LSB with 40 fraction bits in each state, and does "
        "not: raise output.max_error, raise output.bits or decimate by 32 first, "
        "as the cutoff is 1/1000 of the sample rate",
        beyond_half=Fraction(1, 10**8),
        ideal=butterworth(2, 0.001),
        realization="df1",
        output=EIGHT_BITS,
    )


def test_calibration() -> None:
    refused(
        "the calibration must keep its error below 1e-13 output LSB with 40 fraction bits, not 9.32e-13: raise "
        "output.max_error or output.bits",
        beyond_half=Fraction(1, 10**13),
        ideal=None,
        polynomial=Polynomial.from_numbers([["0.1", "0.2"], ["0.3"]]),
    )


@pytest.mark.parametrize("realization", ["df1", "df1_ef2"])
def test_a_cutoff_too_low_for_any_format(realization: str) -> None:
    refused(
        "the impulse response must end within 2097152 samples, not 34703473: a pole lies too close to the unit "
        "circle, decimate by 1024 first",
        beyond_half=Fraction(1, 2),
        ideal=butterworth(7, 0.000001),
        realization=realization,
    )


LONG = r"the impulse response must end within 2097152 samples, not \d+: a pole lies too close to the unit circle"
AWAY = ", move the cutoff further from 0 and from half the sample rate"


@pytest.mark.parametrize(
    ("ideal", "remedy"),
    [
        (replace(butterworth(1, 0.2, "bandstop"), cutoff=(0.2, 0.2000001)), ", widen the band"),
        (replace(butterworth(1, 0.2, "highpass"), cutoff=(1e-6,)), AWAY),
        (replace(butterworth(1, 0.2), cutoff=(0.499999,)), AWAY),
        (replace(butterworth(1, 0.2), cutoff=None), ""),
    ],
)
def test_a_response_too_long_for_another_reason(ideal: Filter, remedy: str) -> None:
    slow = with_rows(ideal, [(1.0, 0.0, 0.0, 1.0, 0.0, 1 - 2.0**-22)])
    with pytest.raises(ShortfallError, match=f"^{LONG}{remedy}$"):
        plain(slow)


NARROW: Row = (0.1425, 0.285, 0.1425, 1.0, -1.4, 0.97)


@pytest.mark.parametrize("realization", CASCADES)
def test_a_section_unstable_by_quantization(realization: str) -> None:
    """Whatever the realization, its denominator is that of the rounded coefficients."""
    bits = 2 if realization == "normal" else 1
    pattern = (
        rf"^section4 must be stable with coefficients of {bits} bits: "
        r"poles must lie inside the unit circle, not at a1 = -1\.5, a2 = 1\.\d+$"
    )
    with pytest.raises(ShortfallError, match=pattern):
        REALIZATIONS[realization].build(NARROW, SectionFormat(coefficient_bits=bits), "section4")


@pytest.mark.parametrize("realization", CASCADES)
def test_a_section_that_passes_nothing(realization: str) -> None:
    with pytest.raises(ShortfallError, match=r"^numerator of section4 must not be zero$"):
        REALIZATIONS[realization].build((0.0, 0.0, 0.0, *NARROW[3:]), SectionFormat(coefficient_bits=16), "section4")


@pytest.mark.parametrize("realization", CASCADES)
def test_no_coefficient_becomes_zero(realization: str) -> None:
    """Significant bits, not fraction bits: the smallest coefficient keeps as many as the largest."""
    row: Row = (1e-8, 2e-8, 1e-8, 1.0, -2 + 2e-4, 1 - 2e-4 + 4e-8)
    graph = REALIZATIONS[realization].build(row, SectionFormat(coefficient_bits=20), "section4").graph
    factors = [node.parameter for node in graph.nodes if node.op.value == "scale"]
    assert factors
    assert all(factors)
