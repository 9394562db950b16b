"""Exact filters: against scipy, against closed forms, and their stability by another criterion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from scipy import signal

from sosmith.instrument.paper.arithmetic import (
    bilinear,
    butterworth_factors,
    butterworth_polynomial,
    cutoffs_of,
    dc_gain,
    digits_for_stability,
    gain_db,
    loss_db,
    multiply,
    pole_radii,
    prewarped,
    rounded,
    scaled,
)
from sosmith.instrument.paper.figures import read_paper_figures

PERIOD = Fraction(1, 100)
CUTOFF = Fraction("1.626")
FIGURES = read_paper_figures()


def seventh() -> tuple[tuple[Fraction, ...], tuple[Fraction, ...]]:
    return bilinear(scaled(butterworth_polynomial(7), CUTOFF), PERIOD)


def stable(denominator: Sequence[Fraction]) -> bool:
    """Schur and Cohn's criterion in fractions: every reflection coefficient is below 1 in magnitude."""
    a = [value / denominator[0] for value in denominator]
    while len(a) > 1:
        k = a[-1]
        if abs(k) >= 1:
            return False
        a = [(x - k * y) / (1 - k * k) for x, y in zip(a[:-1], a[:0:-1], strict=True)]
    return True


@pytest.mark.parametrize("order", [1, 2, 3, 5, 7, 8])
def test_polynomials_are_those_of_scipy(order: int) -> None:
    expected = signal.butter(order, 1, analog=True)[1]
    np.testing.assert_allclose([float(value) for value in butterworth_polynomial(order)], expected, rtol=1e-12)


@pytest.mark.parametrize("order", [1, 4, 5])
def test_filters_are_those_of_scipy(order: int) -> None:
    b, a = bilinear(scaled(butterworth_polynomial(order), Fraction(2)), Fraction(1, 6))
    cutoff = 6 / math.pi * math.atan(2 / 12)
    expected = signal.butter(order, cutoff, fs=6)
    np.testing.assert_allclose([float(value) for value in b], expected[0], rtol=1e-11)
    np.testing.assert_allclose([float(value) for value in a], expected[1], rtol=1e-11)


def test_sections_multiply_to_the_whole_filter_exactly() -> None:
    numerator: tuple[Fraction, ...] = (Fraction(1),)
    denominator = numerator
    for factor in butterworth_factors(7):
        b, a = bilinear(scaled(factor, CUTOFF), PERIOD)
        numerator, denominator = multiply(numerator, b), multiply(denominator, a)
    assert (numerator, denominator) == seventh()
    assert dc_gain(*seventh()) == 1


def test_pole_radii_follow_from_the_closed_form() -> None:
    angles = [math.pi * (2 * k + 8) / 14 for k in range(7)]
    s = [float(CUTOFF) * complex(math.cos(angle), math.sin(angle)) for angle in angles]
    expected = sorted((abs((200 + pole) / (200 - pole)) for pole in s), reverse=True)
    assert pole_radii(seventh()[1]) == pytest.approx(expected, rel=1e-12)


def test_the_printed_denominator_is_unstable_by_both_criteria() -> None:
    printed = [Fraction(value) for value in FIGURES.numbers("table_10", "denominator")]
    assert pole_radii(printed) == pytest.approx(sorted(abs(np.roots([float(v) for v in printed])), reverse=True))
    assert [round(radius, 3) for radius in pole_radii(printed)[:3]] == [1.726, 1.372, 1.372]
    assert not stable(printed)


@pytest.mark.parametrize("digits", range(3, 22))
def test_stability_of_rounded_denominators_agrees_with_schur_and_cohn(digits: int) -> None:
    denominator = rounded(seventh()[1], digits)
    assert stable(denominator) == (pole_radii(denominator)[0] < 1) == (digits >= 15)


def test_digits_for_stability() -> None:
    assert digits_for_stability(seventh()[1]) == 15
    assert digits_for_stability((Fraction(1), Fraction(-1, 2))) == 1


def test_rounding_is_to_significant_digits() -> None:
    values = [Fraction(-692693, 10**5), Fraction("0.00012345"), Fraction(33917, 1000)]
    assert rounded(values, 4) == (Fraction("-6.927"), Fraction("0.0001234"), Fraction("33.92"))


@pytest.mark.parametrize(("frequency", "loss"), [(1.2, 93), (2.0, 124), (10.0, 224)])
def test_digital_and_analog_loss_agree(frequency: float, loss: float) -> None:
    digital = -gain_db(*seventh(), frequency, 100.0)
    assert digital == pytest.approx(loss_db(prewarped(frequency, 0.01), float(CUTOFF), 7), rel=1e-12)
    assert round(digital) == loss


def test_cutoffs_are_found_again() -> None:
    polynomial = butterworth_polynomial(5)
    printed = [round(float(value), 9) for value in scaled(polynomial, CUTOFF)]
    found = cutoffs_of(polynomial, [Decimal(str(value)) for value in printed])
    assert found == pytest.approx([1.626] * 5, rel=1e-7)
