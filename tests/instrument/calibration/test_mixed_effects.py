"""The mixed-effects model against the same model written out as one dense covariance matrix."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from sosmith.instrument.calibration.mixed_effects import model as mixed_effects
from sosmith.instrument.calibration.mixed_effects.model import Model, Rows, Scatters, mixture_half_width
from sosmith.instrument.calibration.mixed_effects.systematic_error import SystematicCurves
from sosmith.instrument.calibration.sensor_type import SENSOR_TYPES, SYSTEMATIC_FACTOR
from sosmith.model.arithmetic import stacked_matrices
from sosmith.model.arrays import Values

TYPE = SENSOR_TYPES["equation_5a"]
DAYS = (100, 101, 104, 120)
PER_DAY = (6, 1, 9, 4)
SCATTER, RATIO = 0.3, 0.6
KNOWN = 0.2


class Case:
    """A few days of random measurements, and what a dense Gaussian model says about them.

    With `references`, the variance of every third one is known.
    """

    def __init__(self, *, references: bool) -> None:
        generator = np.random.default_rng(3)
        self.day = np.repeat(np.arange(len(DAYS)), PER_DAY)
        count = len(self.day)
        self.V, self.T = generator.uniform(0.5, 9.5, count), generator.uniform(20.0, 98.0, count)
        clearance = TYPE.polynomial((0.5, -1.0, 0.3, 0.0, 0.7))(self.V, self.T)
        self.curves = SystematicCurves(float(clearance.min()), float(clearance.max()), TYPE.correlation)
        self.rows = Rows(
            a=TYPE.columns(self.V, self.T),
            h=self.curves.columns(clearance),
            r=clearance + generator.normal(0, SCATTER, count) - TYPE.polynomial()(self.V, self.T),
            day=self.day,
            days=DAYS,
            known=KNOWN**2 * references * (np.arange(count) % 3 == 0),
        )
        self.model = Model.of(TYPE, self.rows, np.ones(count))
        self.one = Scatters(np.array([SCATTER]), np.array([RATIO]), np.ones(1), np.ones(1))

    def walk(self, days: Values, others: Values) -> Values:
        """Covariance of the deviations of days with those of others, shape (5, len(days), len(others))."""
        since = np.minimum.outer(days, others) - DAYS[0]
        return np.array([1.0 + drift * since for drift in TYPE.drifts])

    def covariance(self, scatter: float, ratio: float) -> Values:
        """Dense covariance of the measurements."""
        a, h = self.rows.a, self.rows.h
        days = np.array(DAYS)[self.day]
        same = np.equal.outer(self.day, self.day)
        drifting = np.einsum("in,inm,im->nm", a, self.walk(days, days), a)
        return np.asarray(drifting + (scatter * ratio) ** 2 * (h.T @ h) * same + self.noise(scatter))

    def noise(self, scatter: float) -> Values:
        """Dense covariance of what is each measurement's own."""
        return np.diag(np.where(self.rows.known > 0, self.rows.known, scatter**2))


@pytest.fixture(scope="module", params=[False, True], ids=["scatter", "references"])
def case(request: pytest.FixtureRequest) -> Case:
    return Case(references=request.param)


@pytest.mark.parametrize("date", [DAYS[-1], DAYS[-1] + 10])
def test_the_posterior_is_that_of_the_dense_model(case: Case, date: int) -> None:
    posterior = case.model.posterior(case.one, case.curves, date)
    assert posterior.same_day == (date == DAYS[-1])
    V, T = np.array([1.0, 4.0, 9.0]), np.array([30.0, 60.0, 95.0])
    a = TYPE.columns(V, T)
    h = case.curves.columns(TYPE.polynomial(posterior.deviations)(V, T))
    own = (np.array(DAYS)[case.day] == date) * (SCATTER * RATIO) ** 2 * (h.T @ case.rows.h)
    cross = np.einsum("in,inm,im->nm", a, case.walk(np.full(3, date), np.array(DAYS)[case.day]), case.rows.a) + own
    inverse = np.linalg.inv(case.covariance(SCATTER, RATIO))
    prior = np.einsum("in,inn,in->n", a, case.walk(np.full(3, date), np.full(3, date)), a)
    prior = prior + (SCATTER * RATIO) ** 2 * ((h * h).sum(axis=0) if posterior.same_day else 1.0)
    mean, variance = posterior.predicted(V, T)
    assert mean[:, 0] - TYPE.polynomial()(V, T) == pytest.approx(cross @ inverse @ case.rows.r, rel=1e-9)
    assert variance[:, 0] == pytest.approx(prior - np.einsum("nm,mk,nk->n", cross, inverse, cross), rel=1e-9)


def test_pairs_of_scatters_are_weighted_by_their_marginal_likelihood(case: Case) -> None:
    scatters, ratios = np.array([0.2, 0.3, 0.5]), np.array([0.1, 0.6])
    found = case.model.weighed(scatters, ratios)
    dense = np.array(
        [
            stats.multivariate_normal.logpdf(case.rows.r, cov=case.covariance(scatter, ratio))
            - (math.log(max(scatter * ratio, 0.03 * TYPE.systematic) / TYPE.systematic) / math.log(SYSTEMATIC_FACTOR))
            ** 2
            / 2
            for scatter, ratio in zip(found.scatter, found.ratio, strict=True)
        ]
    )
    expected = np.exp(dense - dense.max())
    assert len(found.weight) > 2
    assert found.weight == pytest.approx(expected / expected.sum(), rel=1e-9)


def test_intervals_are_weighted_with_jeffreys_prior(case: Case) -> None:
    """The root of the determinant of Fisher's information about the logarithms of scatter and systematic error."""
    found = case.model.weighed(np.array([0.2, 0.3, 0.5]), np.array([0.3, 0.6, 1.2]))
    roots = []
    for scatter, ratio in zip(found.scatter, found.ratio, strict=True):
        same = np.equal.outer(case.day, case.day)
        by_logarithm = (
            2 * scatter**2 * np.diag(case.rows.known == 0),
            2 * (scatter * ratio) ** 2 * (case.rows.h.T @ case.rows.h) * same,
        )
        inverse = np.linalg.inv(by_logarithm[1] / 2 + case.noise(scatter))
        fisher = [[np.trace(inverse @ a @ inverse @ b) / 2 for a in by_logarithm] for b in by_logarithm]
        roots.append(math.sqrt(np.linalg.det(fisher)))
    expected = found.weight * roots
    assert len(expected) > 4
    assert np.ptp(roots) > (0.5 if not case.rows.known.any() else 0.3) * max(roots)
    assert found.of_intervals == pytest.approx(expected / expected.sum(), rel=1e-9)


DAY_ERROR = 0.2
"""Systematic error of a day in mm rms: twice what the type expects."""


@pytest.mark.slow
def test_intervals_hold_their_share_for_a_sensor_worse_than_its_type() -> None:
    """Everything is as the model has it, so that the share that the intervals hold on a new day is known exactly."""
    days, each, points = 6, 15, 5
    V_now, T_now = np.linspace(1.0, 9.0, points), np.full(points, 60.0)
    curves, shares = SystematicCurves(1.0, 11.0, TYPE.correlation), []
    for seed in range(60):
        generator = np.random.default_rng(seed)
        V, T = generator.uniform(0.5, 9.5, days * each), generator.uniform(20.0, 98.0, days * each)
        day = np.repeat(np.arange(days), each)
        h, a = curves.columns(np.clip(TYPE.polynomial()(V, T), 1.0, 11.0)), TYPE.columns(V, T)
        steps = generator.normal(size=(days + 1, 5)) * np.sqrt([np.ones(5), *[TYPE.drifts] * days])
        deviations = np.cumsum(steps, axis=0)
        weights = DAY_ERROR * generator.normal(size=(days, curves.count))
        r = np.sum(a.T * deviations[day], axis=1) + np.sum(h.T * weights[day], axis=1)
        rows = Rows(a, h, r + generator.normal(0.0, 0.45, len(r)), day, tuple(range(days)), np.zeros(len(r)))
        model = Model.of(TYPE, rows, np.ones(len(r)))
        posterior = model.posterior(model.scatters(), curves, days)
        centre = posterior.curve(V_now, T_now)
        off = centre - TYPE.polynomial()(V_now, T_now) - TYPE.columns(V_now, T_now).T @ deviations[days]
        half = posterior.half_width(V_now, T_now, centre, 0.95)
        shares.append(np.mean(stats.norm.cdf((half - off) / DAY_ERROR) - stats.norm.cdf((-half - off) / DAY_ERROR)))
    assert 0.93 < np.mean(shares) < 0.97


def test_residuals_are_those_of_the_smoothed_days(case: Case) -> None:
    signal = case.covariance(SCATTER, RATIO) - case.noise(SCATTER)
    expected = case.rows.r - signal @ np.linalg.solve(case.covariance(SCATTER, RATIO), case.rows.r)
    assert case.model.residuals(case.one) == pytest.approx(expected, rel=1e-8, abs=1e-12)


def test_a_fold_without_a_day_is_the_model_without_it(case: Case) -> None:
    left_out = np.zeros((2, len(DAYS)))
    left_out[1, 2] = 1.0
    course = case.model.course(case.one, left_out)
    without = Model.of(TYPE, case.rows, np.where(case.day == 2, 0.0, 1.0)).course(case.one)
    assert course.mean[-1][:, 1] == pytest.approx(without.mean[-1], rel=1e-12)
    assert course.mean[-1][:, 0] == pytest.approx(case.model.course(case.one).mean[-1], rel=1e-12)


def test_the_fine_grid_finds_the_scatter() -> None:
    generator = np.random.default_rng(1)
    count, scatter = 4000, 0.137
    V, T = generator.uniform(0.5, 9.5, count), generator.uniform(20.0, 98.0, count)
    day = np.repeat(np.arange(40), count // 40)
    r, known = generator.normal(0, scatter, count), np.zeros(count)
    rows = Rows(TYPE.columns(V, T), np.zeros((1, count)), r, day, tuple(range(40)), known)
    found = Model.of(TYPE, rows, np.ones(count)).scatters()
    assert found.mean_of(found.scatter) == pytest.approx(scatter, rel=0.03)


def test_the_interval_of_one_normal_number_is_its_quantile() -> None:
    half = mixture_half_width(np.zeros((1, 1)), np.array([[4.0]]), np.ones(1), 0.95)
    assert half == pytest.approx([2 * stats.norm.ppf(0.975)], rel=1e-9)


def test_the_interval_of_a_mixture_holds_its_share() -> None:
    off, variance, weight = np.array([[0.0, 0.3]]), np.array([[0.01, 0.25]]), np.array([0.7, 0.3])
    (half,) = mixture_half_width(off, variance, weight, 0.9)
    inside = [stats.norm(m, math.sqrt(v)).cdf([half, -half]) for m, v in zip(off[0], variance[0], strict=True)]
    assert sum(w * (high - low) for w, (high, low) in zip(weight, inside, strict=True)) == pytest.approx(0.9, rel=1e-9)


@pytest.mark.parametrize("name", ["day_filter", "day_sums", "model", "stacked_matrices", "systematic_error"])
def test_no_kernel_of_a_machine_has_a_part_in_it(name: str) -> None:
    """Matrix products and elementary functions of numpy differ in the last bits from machine to machine."""
    (path,) = (
        Path(mixed_effects.__file__).parents[2].glob(f"**/mixed_effects/{name}.py")
        if name != "stacked_matrices"
        else [Path(stacked_matrices.__file__)]
    )
    source = path.read_text(encoding="utf-8")
    used = set(re.findall(r"np\.(?:exp|log|power|matmul|dot|einsum|inner|linalg)\b| @ ", source))
    assert used == set()
