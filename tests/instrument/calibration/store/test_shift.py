"""The shift of a sensor: signed, with an interval, and only where the version before is calibrated."""

from dataclasses import replace

import numpy as np
import pytest
from tests.instrument.calibration.bayesian import measured, version_of

from sosmith.instrument.calibration.store.shift import shift_from

KNOWN = measured(2, 30, scatter=0.05)


def test_a_sensor_that_reads_more_or_less() -> None:
    version = version_of(KNOWN)
    added = measured(1, 25, scatter=0.05, seed=9)
    found = shift_from(version, KNOWN, replace(added, clearance=added.clearance + 0.3))
    assert found is not None
    assert found.mean == pytest.approx(-0.3, abs=0.05)
    assert 0.005 < found.half_width < 0.05
    assert found.sentence == (
        f"the sensor reads {-found.mean:.3g} mm less than by version 3 of 2024-03-01, ±{found.half_width:.2g} mm"
    )
    more = shift_from(version, KNOWN, replace(added, clearance=np.maximum(added.clearance - 0.3, 0)))
    assert more is not None
    assert "mm more than by" in more.sentence


@pytest.mark.slow
def test_where_nothing_is_calibrated_there_is_no_shift() -> None:
    hot = replace(KNOWN, temperature=KNOWN.temperature + 100)
    assert shift_from(version_of(KNOWN), KNOWN, hot) is None
    assert shift_from(replace(version_of(KNOWN), method="bayes"), KNOWN, hot) is not None  # as the type goes on
    one = shift_from(version_of(KNOWN), KNOWN, KNOWN.of(np.arange(len(KNOWN)) == 20))
    assert one is not None
    assert one.half_width == np.inf
