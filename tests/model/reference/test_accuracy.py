"""Accuracy measures against the paper's own tables and closed forms."""

from __future__ import annotations

import re

import numpy as np
import pytest

from sosmith.model.reference.accuracy import accuracy_percent, error_statistics, sqnr_db

TRUTH = np.arange(1.0, 11.0)
TABLE_1_ERROR = np.array(
    [0.02595, 0.020736, 0.024471, 0.078376, 0.081988, 0.056695, 0.01452, 0.02922, 0.027095, 0.0226914]
)


def test_equation_7_on_table_1() -> None:
    # Sum of error / clearance, added up by hand: 0.1009222 over ten readings.
    assert accuracy_percent(TRUTH + TABLE_1_ERROR, TRUTH) == pytest.approx(98.990778, abs=1e-5)


def test_table_1_is_equation_7_without_its_division() -> None:
    # The printed 96.1826 % takes every error in relation to 1 mm.
    assert accuracy_percent(1.0 - TABLE_1_ERROR, np.ones(10)) == pytest.approx(96.1826, abs=1e-4)


def test_only_readings_count() -> None:
    measured, truth = np.array([1.1, 5.0, -2.2]), np.array([1.0, 0.0, -2.0])
    assert accuracy_percent(measured, truth, np.array([True, False, True])) == pytest.approx(90.0)


def test_accuracy_refusals() -> None:
    two = np.array([1.0, 0.0])
    for message, arguments in (
        ("truth must differ from zero at every reading, not be 0", (two, two)),
        ("truth must be of shape (2,), not (10,)", (two, TRUTH)),
        ("reading must be of shape (2,), not (1,)", (two, two, np.array([True]))),
        ("reading must mark at least one sample, not none", (two, two, np.array([False, False]))),
    ):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            accuracy_percent(*arguments)


def test_error_statistics() -> None:
    statistics = error_statistics(np.array([1.0, -3.0, 3.0, 1.0]))
    assert (statistics.max_abs, statistics.mean, statistics.worst) == (3.0, 0.5, 1)
    assert statistics.rms == pytest.approx(np.sqrt(5.0))
    with pytest.raises(ValueError, match=r"^error must have at least one sample, not none$"):
        error_statistics(np.array([]))


def test_sqnr_of_an_ideal_16_bit_quantizer() -> None:
    # 6.02 dB per bit + 1.76 dB for a full-scale sine.
    sine = np.sin(2 * np.pi * np.sqrt(2) / 10 * np.arange(100_000))
    lsb = 2.0**-15
    assert sqnr_db(sine, np.rint(sine / lsb) * lsb - sine) == pytest.approx(6.0206 * 16 + 1.7609, abs=0.05)


def test_sqnr_that_is_not_finite_is_none() -> None:
    one, zero = np.ones(3), np.zeros(3)
    assert sqnr_db(one, zero) is None
    assert sqnr_db(zero, one) is None
    assert sqnr_db(one, one) == 0.0
    with pytest.raises(ValueError, match=f"^{re.escape('error must be of shape (3,), not (2,)')}$"):
        sqnr_db(one, np.ones(2))
