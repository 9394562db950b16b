"""The labels of figures beside the printed ones."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

import pytest

from sosmith.instrument.paper.comparison import (
    DIFFERS,
    NEAR,
    NOT_COMPARABLE,
    NOT_PRINTED,
    REPRODUCED,
    compare,
    compare_accuracy,
)

REASON = "because"


@pytest.mark.parametrize(
    ("printed", "ours", "label"),
    [
        ("1.234", 1.2344, REPRODUCED),
        ("1.234", 1.2346, REPRODUCED),  # one off in the last digit, worth less than a hundredth
        ("1.234", 1.2356, NEAR),
        ("1.234", 1.2586, NEAR),
        ("1.234", 1.2588, DIFFERS),
        ("-1.234", -1.2344, REPRODUCED),
        ("-1.234", 1.2344, DIFFERS),
        ("2.273e-15", 2.2728e-15, REPRODUCED),
        ("2.273e-15", 2.2634e-15, NEAR),
        ("2.273e-15", 0.0, DIFFERS),
        ("7", 6, DIFFERS),  # one off in the last digit, but that is much of it
        ("7", 7, REPRODUCED),
        ("5", Fraction(49, 10), REPRODUCED),
        ("0.0014", 0.0013, DIFFERS),
        ("100", 101, REPRODUCED),
    ],
)
def test_labels(printed: str, ours: float | Fraction, label: str) -> None:
    assert compare("x", Decimal(printed), ours, note=REASON).label == label


def test_of_accuracies_what_is_missing_counts() -> None:
    assert compare_accuracy("x", Decimal("97.2"), 96.88).label == DIFFERS
    assert compare("x", Decimal("97.2"), 96.88).label == NEAR
    assert compare_accuracy("x", Decimal("96.5"), 96.5335).label == REPRODUCED
    assert compare_accuracy("x", Decimal("96.5"), 96.56).label == NEAR
    assert compare_accuracy("x", Decimal("96.5"), 96.6).label == DIFFERS


def test_what_cannot_be_compared_is_not_reproduced() -> None:
    assert compare("x", Decimal("1.5"), 1.5, comparable=False, note=REASON).label == NOT_COMPARABLE
    assert compare("x", Decimal("1.5"), None, note=REASON).label == NOT_COMPARABLE
    assert compare("x", None, 1.5).label == NOT_PRINTED


def test_a_missing_explanation_is_named() -> None:
    assert compare("x", Decimal("1.5"), 3).explanation == "not explained"
    assert compare("x", Decimal("1.5"), None).explanation == "not explained"
    assert compare("x", Decimal("1.5"), 3, note=REASON).explanation == REASON
    assert compare("x", Decimal("1.5"), 1.5).explanation == ""


@pytest.mark.parametrize(
    ("printed", "ours", "shown"),
    [
        ("1.23", 1.23456, "1.235"),
        ("1.1", 1.0966, "1.097"),
        ("5", 5, "5"),
        ("60", 60, "60"),
        ("2.0736", Fraction("2.0736"), "2.0736"),
        ("9", 11, "11"),
        ("2.273e-15", 2.26342e-15, "2.2634e-15"),
        ("0.001076", 0.0010757074, "0.0010757"),
        ("0.02", 60, "60.00"),
        (None, 2 / 3, "0.666667"),
        (None, 0, "0"),
    ],
)
def test_ours_is_shown_with_a_digit_more(printed: str | None, ours: float | Fraction, shown: str) -> None:
    assert compare("x", None if printed is None else Decimal(printed), ours).shown == shown
