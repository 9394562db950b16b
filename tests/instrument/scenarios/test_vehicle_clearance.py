"""The vehicle's motion for scenario files: the model's own, at any sample rate, as long as asked for."""

from __future__ import annotations

import numpy as np
import pytest

from sosmith.instrument.scenarios.vehicle_clearance import IRREGULARITY, SPEED, WHEELSET, vehicle_clearance
from sosmith.instrument.vehicle.choices import MODELS
from sosmith.instrument.vehicle.parameters import built_in
from sosmith.instrument.vehicle.run import run
from sosmith.instrument.vehicle.track import curved_track, tangent_track


@pytest.mark.slow
@pytest.mark.parametrize(("name", "make"), [("paper", curved_track), ("tangent", tangent_track)])
@pytest.mark.parametrize("model", MODELS)
def test_it_is_the_models_own_motion(name: str, make: object, model: str) -> None:
    assert callable(make)
    parameters = built_in()
    settings = {"speed": SPEED, "sample_rate": 100.0, "irregularity": IRREGULARITY, "seed": 3}
    motion = run(parameters, make(parameters.track), **settings, model=model, distance=50.0)
    time = np.arange(200) / 100
    found = vehicle_clearance(name, time, 3, model=model)
    np.testing.assert_allclose(found, motion.clearance_mm[:200, WHEELSET], atol=1e-6)
    if model == "nonlinear":
        assert (found == vehicle_clearance(name, time, 3)).all()


@pytest.mark.slow
def test_a_curve_shows_and_another_seed_differs() -> None:
    time = np.arange(6 * 25) / 6
    curve, straight = (vehicle_clearance(track, time, 1, model="linear") for track in ("paper", "tangent"))
    inside = (time > 6) & (time < 16)  # the curve, 60 to 360 m
    assert abs(np.mean((curve - straight)[inside])) > 0.5
    assert np.any(curve != vehicle_clearance("paper", time, 2, model="linear"))


@pytest.mark.slow
@pytest.mark.parametrize(("samples", "rate"), [(1, 100.0), (2, 6.0), (360, 6.0), (3000, 100.0)])
def test_any_length(samples: int, rate: float) -> None:
    assert vehicle_clearance("paper", np.arange(samples) / rate, 1, model="linear").shape == (samples,)
