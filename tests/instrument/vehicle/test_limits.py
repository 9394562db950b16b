"""Limits of guiding forces: sliding means over 2 m, Prud'homme's sum."""

import numpy as np
import pytest

from sosmith.instrument.vehicle.lateral import wheelset_load
from sosmith.instrument.vehicle.limits import SLIDING, limits, prudhomme_limit, sliding_mean
from sosmith.instrument.vehicle.parameters import built_in
from sosmith.instrument.vehicle.run import run
from sosmith.instrument.vehicle.track import curved_track


def test_a_peak_counts_by_its_share_of_two_metres() -> None:
    distance = 0.1 * np.arange(200)
    peak = np.zeros((200, 2))
    peak[50:55, 0] = 8.0
    found = sliding_mean(peak, distance)
    assert found.shape == (181, 2)
    assert found.max(axis=0) == pytest.approx([8.0 * 0.5 / SLIDING, 0.0])
    assert sliding_mean(np.full((200, 2), 3.0), distance) == pytest.approx(3.0)


def test_a_short_record_has_one_mean() -> None:
    assert sliding_mean(np.array([1.0, 2.0, 6.0]), np.array([0.0, 0.5, 1.0])) == pytest.approx([3.0])
    assert sliding_mean(np.array([4.0]), np.zeros(1)) == pytest.approx([4.0])


@pytest.mark.slow
def test_the_sum_of_guiding_forces_and_its_limit() -> None:
    given = built_in()
    track = curved_track(given.track)
    motion = run(given, track, speed=20.0, sample_rate=100.0, distance=60.0, model="linear")
    found = limits(given, track, motion)
    assert found.prudhomme == pytest.approx(10e3 + wheelset_load(given) / 3)
    assert prudhomme_limit(225e3) == pytest.approx(85e3)
    to_the_right = motion.guiding_force[:, :, 1] - motion.guiding_force[:, :, 0]
    means = [np.convolve(to_the_right[:, k], np.full(10, 0.1), "valid") for k in range(6)]
    assert found.guiding_sum == pytest.approx([np.abs(one).max() for one in means])
    assert np.all(found.sliding_quotient <= found.derailment_quotient)
    assert found.guiding_sum.max() > 0
