"""Advice on measurements: what it promises is what the measurements then bring."""

from statistics import NormalDist

import numpy as np
import pytest
from tests.instrument.calibration.bayesian import FIRST, RANGES, TYPE, fitted, measured

from sosmith.instrument.calibration.advice import advise
from sosmith.instrument.calibration.bayesian_fit import BayesianFit
from sosmith.instrument.calibration.mixed_effects.model import Model, Rows
from sosmith.model.errors import SpecificationError


@pytest.fixture(scope="module")
def made() -> BayesianFit:
    return fitted(measured(6, 12, systematic=0.15), FIRST + 5)


def test_the_promise_is_the_posterior_after_measuring_so(made: BayesianFit) -> None:
    found = advise(made, RANGES, (2.0, 3.0), (60.0,), within=0.2, days=3)
    assert found.reached
    assert max(found.before) > 0.2 >= max(found.after)
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
    after = Model.of(TYPE, rows, weights).posterior(
        made.posterior.scatters.likeliest, made.posterior.curves, rows.days[-1]
    )
    targets = [np.array(values) for values in zip(*found.targets, strict=True)]
    V = np.array([np.interp(d, curve(V_grid, T), V_grid) for d, T in found.targets])
    shifted = TYPE.polynomial(after.deviations)(V, targets[1]) - targets[0]
    assert shifted == pytest.approx([0.0, 0.0], abs=0.5)
    _, variance = after.predicted(V, targets[1])
    assert NormalDist().inv_cdf(0.975) * np.sqrt(variance[:, 0]) == pytest.approx(found.after, rel=0.05)


def test_measurements_are_advised_near_what_matters(made: BayesianFit) -> None:
    found = advise(made, RANGES, (3.0,), (60.0,), within=0.2)
    assert all(abs(d - 3.0) <= 2.0 for d, _, _ in found.plan)


def test_a_narrower_wish_takes_more_measurements(made: BayesianFit) -> None:
    wide, narrow = (advise(made, RANGES, (3.0,), (60.0,), within=within) for within in (0.25, 0.15))
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
