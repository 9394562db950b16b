"""Advice on measurements: what it promises is what the measurements then bring."""

from dataclasses import replace

import numpy as np
import pytest
from tests.instrument.calibration.bayesian import FIRST, RANGES, TYPE, fitted, measured

from sosmith.instrument.calibration.advice import PROMISED, advise
from sosmith.instrument.calibration.bayesian_fit import BayesianFit, bayesian_fit
from sosmith.instrument.calibration.mixed_effects.model import Model, Rows
from sosmith.model.errors import SpecificationError


@pytest.fixture(scope="module")
def made() -> BayesianFit:
    return fitted(measured(6, 12, systematic=0.15), FIRST + 5)


def test_the_promise_is_the_posterior_after_measuring_so() -> None:
    any_order = replace(TYPE, order=8)  # so that next to nothing of the curve is missed
    made = bayesian_fit(measured(6, 12, systematic=0.15), any_order, FIRST + 5, RANGES)
    found = advise(made, RANGES, (2.0, 3.0), (60.0,), within=0.25, days=3)
    assert found.reached
    assert max(found.before) > 0.25 >= max(found.after)
    curve = TYPE.polynomial(made.posterior.deviations)
    V_grid = np.linspace(0, 10, 2001)

    def columns(points: list[tuple[float, float]]) -> tuple[np.ndarray, np.ndarray]:  # type: ignore[type-arg]
        d, T = (np.array(values) for values in zip(*points, strict=True))
        V = np.array([np.interp(one, curve(V_grid, at), V_grid) for one, at in points])
        return TYPE.columns(V, T), made.posterior.curves.columns(d)

    points = [(d, T) for d, T, count in found.plan for _ in range(count)]
    old, (a, h) = made.model.rows, columns(points)
    rows = Rows(
        a=np.concatenate((old.a, a), axis=1),
        h=np.concatenate((old.h, h), axis=1),
        r=np.concatenate((old.r, np.zeros(len(points)))),
        day=np.concatenate((old.day, np.full(len(points), len(old.days)))),
        days=(*old.days, old.days[-1] + 3),
        known=np.zeros(len(old.r) + len(points)),
    )
    weights = np.concatenate((np.array(made.fit.weights)[made.order], np.ones(len(points))))
    after = Model.of(TYPE, rows, weights).posterior(made.posterior.scatters, made.posterior.curves, rows.days[-1])
    targets = [np.array(values) for values in zip(*found.targets, strict=True)]
    V = np.array([np.interp(d, curve(V_grid, T), V_grid) for d, T in found.targets])
    shifted = TYPE.polynomial(after.deviations)(V, targets[1]) - targets[0]
    assert shifted == pytest.approx([0.0, 0.0], abs=0.5)
    half = after.half_width(V, targets[1], after.curve(V, targets[1]), 0.95)
    assert PROMISED * half == pytest.approx(found.after, rel=0.05)


def test_what_a_parabola_misses_of_the_days_curve_is_in_the_promise(made: BayesianFit) -> None:
    higher = replace(made, posterior=replace(made.posterior, sensor_type=replace(TYPE, order=8)))
    with_parabola, followed = (
        advise(one, RANGES, (2.0, 5.0, 8.0), (60.0,), within=0.001, most=40).after for one in (made, higher)
    )
    ratios = [a / b for a, b in zip(with_parabola, followed, strict=True)]
    assert min(ratios) > 0.99
    assert max(ratios) > 1.05


def test_targets_of_known_clearance_bring_more(made: BayesianFit) -> None:
    scattering, known = (
        advise(made, RANGES, (3.0,), (60.0,), within=0.001, most=3, uncertainty=u).after for u in (0.0, 0.02)
    )
    assert known < scattering


def test_measurements_are_advised_near_what_matters(made: BayesianFit) -> None:
    found = advise(made, RANGES, (3.0,), (60.0,), within=0.3)
    assert all(abs(d - 3.0) <= 2.0 for d, _, _ in found.plan)


def test_a_narrower_wish_takes_more_measurements(made: BayesianFit) -> None:
    wide, narrow = (advise(made, RANGES, (3.0,), (60.0,), within=within) for within in (0.35, 0.25))
    assert 0 < wide.count < narrow.count
    assert wide.before == narrow.before


def test_what_is_reached_already_takes_none(made: BayesianFit) -> None:
    found = advise(made, RANGES, (3.0,), (60.0,), within=5.0)
    assert (found.count, found.reached) == (0, True)


def test_too_few_measurements_do_not_reach_it(made: BayesianFit) -> None:
    found = advise(made, RANGES, (3.0,), (60.0,), within=0.1, most=3)
    assert (found.count, found.reached) == (3, False)


def test_a_clearance_that_the_sensor_does_not_read_is_refused(made: BayesianFit) -> None:
    text = r"^the clearance must be [\d.]+ to [\d.]+ mm, what the sensor reads at 60 degC, not 15 mm$"
    with pytest.raises(SpecificationError, match=text):
        advise(made, RANGES, (15.0,), (60.0,), within=0.2)
