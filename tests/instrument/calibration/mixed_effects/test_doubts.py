"""Errors that are not those of the type are told, in words; those of the type are not."""

from dataclasses import replace

import numpy as np
import pytest
from tests.instrument.calibration.bayesian import FIRST, TRUE, fitted

from sosmith.gen.calibration.fit import Measurements

DAYS, EACH = 6, 25


def measured(
    seed: int, *, correlation: float = 2.0, lasting: float = 0.0, days: int = DAYS, scatter: float = 0.03
) -> Measurements:
    """Days whose error of 0.1 mm is a Gaussian process over the clearance, beside one that stays."""
    chance = np.random.default_rng(seed)
    columns = []
    for day in range(days):
        V, T = chance.uniform(0.5, 9.5, EACH), chance.uniform(20.0, 95.0, EACH)
        d = TRUE(V, T) + lasting * np.sin(2 * np.pi * TRUE(V, T) / 6.0)
        covariance = np.exp(-(np.subtract.outer(d, d) ** 2) / (2 * correlation**2)) + 1e-9 * np.eye(EACH)
        d = d + 0.1 * np.linalg.cholesky(covariance) @ chance.normal(size=EACH)
        columns.append([np.maximum(d + chance.normal(0, scatter, EACH), 0), V, T, np.full(EACH, FIRST + day)])
    d, V, T, day = np.concatenate(columns, axis=1)
    return Measurements(d, V, T, "m.csv", tuple(day.astype(int).tolist()))


@pytest.mark.sweep(1)
@pytest.mark.parametrize("seed", range(3))
def test_errors_of_the_type_are_no_reason_to_doubt(seed: int) -> None:
    assert fitted(measured(seed)).doubts == ()


@pytest.mark.slow
def test_errors_over_a_shorter_clearance() -> None:
    assert fitted(measured(1, correlation=0.5)).doubts == (
        "the errors of a day vary over about 0.5 mm, not over 2 mm as those of the type equation_5a: a type with "
        "correlation = 0.5 gives the right intervals",
    )


def test_errors_that_are_an_offset() -> None:
    assert fitted(measured(1, correlation=1e3)).doubts == (
        "the errors of a day are the same at all clearances, not over 2 mm as those of the type equation_5a: a type "
        "with correlation = 20 gives the right intervals",
    )


@pytest.mark.slow
def test_an_error_that_stays() -> None:
    assert fitted(measured(1, lasting=0.2)).doubts == (
        "the measurements of all days miss the curve alike, which its orders cannot follow: what is booked as the "
        "error of a day stays, and the intervals do not know that",
    )
    assert fitted(measured(1, lasting=0.2, days=2)).doubts == ()  # too few days


@pytest.mark.slow
def test_too_few_measurements_to_tell_over_which_clearance_a_day_errs() -> None:
    rows = measured(4, scatter=0.3)
    assert fitted(rows).doubts == (
        "the measurements are too few to tell over which clearance the errors of a day vary: if that is 0.5 mm, not 2 "
        "mm as of the type equation_5a, the curve of the day is less certain than its intervals say",
    )
    assert fitted(rows, max(rows.days) + 1).doubts == ()  # nothing is known of the day's own curve


@pytest.mark.slow
def test_intervals_rest_on_that_where_the_polynomial_leaves_the_curve_of_the_day_out() -> None:
    made = fitted(measured(4, scatter=0.3))
    assert made.doubts
    assert not made.plain
    assert replace(made, plain=True).doubts == made.doubts
