"""Rails inside the range of the port: found, left out and told; what only looks like one is kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.instrument.calibration.bayesian import FIRST, RANGES, TRUE, fitted, measured

from sosmith.gen.calibration.fit import Measurements
from sosmith.instrument.calibration import bayesian_fit
from sosmith.instrument.calibration.bayesian_fit import BayesianFit
from sosmith.instrument.calibration.rails import Rails, rails_of

VOLTAGES = RANGES[1]
SHARE = 0.95


def railed(low: float, high: float, seed: int = 1) -> Measurements:
    """Twenty days of a sensor that saturates at these voltages, inside its port's 0 to 10 V."""
    rows = measured(20, 15, scatter=0.4, systematic=0.15, seed=seed)
    return replace(rows, voltage=np.clip(rows.voltage, low, high))


@pytest.mark.parametrize(("low", "high"), [(0.0, 6.0), (3.5, 10.0), (3.5, 7.0), (0.0, 10.0)])
def test_rails_are_where_the_sensor_has_them(low: float, high: float) -> None:
    found = rails_of(railed(low, high), VOLTAGES)
    assert found.ends == (low, high)
    assert len(found.found) == (low > 0) + (high < 10)


def test_the_sentence() -> None:
    rows = railed(0.0, 6.0)
    at = rows.clearance[rows.voltage == 6.0]
    assert rails_of(rows, VOLTAGES).found == (
        f"{len(at)} readings of 6 V belong to clearances from {at.min():.3g} to {at.max():.3g} mm: "
        "the sensor is at a rail there, and measures nothing above it",
    )


def test_readings_repeated_at_the_end_of_what_was_measured_are_no_rail() -> None:
    """A gauge read again and again, and voltages of one digit."""
    rows = measured(20, 15, scatter=0.4)
    top = rows.voltage > 9.0
    V = np.where(top, 9.0, rows.voltage)
    assert rails_of(replace(rows, voltage=V, clearance=np.where(top, 9.6, rows.clearance)), VOLTAGES) == Rails(VOLTAGES)
    coarse = replace(rows, voltage=np.round(rows.voltage, 1))
    assert rails_of(coarse, VOLTAGES) == Rails(VOLTAGES)


def test_an_outlier_among_repeated_readings_is_no_rail() -> None:
    rows = measured(20, 15, scatter=0.4)
    highest = np.argsort(rows.voltage)[-5:]
    V, d = rows.voltage.copy(), rows.clearance.copy()
    V[highest] = V.max()
    d[highest] = TRUE(V[highest], rows.temperature[highest])
    d[highest[0]] += 5.0
    assert rails_of(replace(rows, voltage=V, clearance=d), VOLTAGES) == Rails(VOLTAGES)


def share_held(made: BayesianFit, seed: int) -> float:
    """Share of the clearances of other days that the intervals hold, below 5.9 V."""
    new = measured(60, 15, scatter=0.0, systematic=0.15, seed=seed)
    below = new.voltage < 5.9
    V, T = new.voltage[below], new.temperature[below]
    curve = made.fit.polynomial(V, T)
    off = np.abs(new.clearance[below] - curve)
    return float(np.mean(off <= made.posterior.half_width(V, T, curve, SHARE)))


@pytest.mark.slow
def test_intervals_hold_below_the_rail_and_nothing_is_calibrated_beyond(monkeypatch: pytest.MonkeyPatch) -> None:
    held, taken_for_readings = [], []
    for seed in (1, 3, 5):
        rows = railed(0.0, 6.0, seed)
        day = max(rows.days) + 1
        made = fitted(rows, day)
        assert made.rails.ends == (0.0, 6.0)
        assert made.at_rail == np.count_nonzero(rows.voltage == 6.0)
        assert made.fit.covered[0][1] < 6.0
        held.append(share_held(made, seed + 100))
        with monkeypatch.context() as patched:
            patched.setattr(bayesian_fit, "rails_of", lambda _, voltages: Rails(voltages))
            taken_for_readings.append(share_held(fitted(rows, day), seed + 100))
    assert min(held) > 0.95
    assert np.mean(taken_for_readings) < 0.85


def test_the_rails_of_the_port_stay_as_they_are() -> None:
    rows = measured(5, 20, scatter=0.05)
    V = rows.voltage.copy()
    V[:6] = 10.0
    found = rails_of(Measurements(rows.clearance, V, rows.temperature, "m.csv", (FIRST,) * len(rows)), VOLTAGES)
    assert found == Rails(VOLTAGES)
    assert found.hold(np.array([0.0, 0.1, 9.9, 10.0])).tolist() == [False, True, True, False]
