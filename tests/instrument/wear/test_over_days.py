"""A record followed over days: its scatter, its risk at the limit, what is refused."""

import re
from typing import Any

import numpy as np
import pytest

from sosmith.instrument.wear.assessment import WearLimits
from sosmith.instrument.wear.over_days import over_days
from sosmith.instrument.wear.state_space import WearModel
from sosmith.model.errors import SpecificationError

LIMITS = WearLimits(initial=1.5, limit=5.0)


def record(days: int, error: float, *, last: float) -> tuple[np.ndarray, np.ndarray]:  # type: ignore[type-arg]
    """Four readings a day of a wheel that wears by 0.05 mm a day and ends at a clearance in mm."""
    generator = np.random.default_rng(6)
    time = np.arange(4 * days) / 4.0
    of_day = np.repeat(generator.normal(0, error, days), 4)
    return time, last - 0.05 * (time[-1] - time) + of_day + generator.normal(0, 0.01, len(time))


def test_the_error_of_a_day_is_found_in_the_scatter_of_the_days() -> None:
    time, clearance = record(60, 0.1, last=5.0)
    found = over_days(time, clearance, LIMITS)
    assert (found.stated, len(found.states)) == (False, 60)
    assert found.day_error == pytest.approx(0.1, rel=0.3)
    assert over_days(time, clearance, LIMITS, day_error=0.07).day_error == 0.07


@pytest.mark.parametrize(("past", "critical"), [(-0.5, False), (0.25, True)])
def test_wear_is_critical_by_the_probability_of_being_past_the_limit(past: float, critical: bool) -> None:
    time, clearance = record(40, 0.1, last=6.5 + past)
    found = over_days(time, clearance, LIMITS, risk=0.05)
    assert found.critical == critical
    assert (found.past >= 0.05) == critical
    low, high = found.interval
    assert low < 6.5 + past < high
    half, soon, late = found.life
    if critical:
        assert half == 0.0
    else:
        assert soon is not None
        assert half is not None
        assert late is not None
        assert soon < 10.0 < late
        assert soon < half < late


def test_the_rate_has_an_interval() -> None:
    time, clearance = record(60, 0.05, last=5.0)
    rate, low, high = over_days(time, clearance, LIMITS).rate
    assert low < 0.05 < high
    assert rate == pytest.approx(0.05, abs=0.01)


def test_what_the_calibration_shares_widens_the_interval() -> None:
    time, clearance = record(60, 0.05, last=5.0)
    (low, high), (lower, higher) = (
        over_days(time, clearance, LIMITS, model=WearModel(shared=shared)).interval for shared in (0.0, 0.2)
    )
    assert higher - lower > 3 * (high - low)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"risk": 0.0}, "risk must be between 0 and 1, not 0"),
        ({"confidence": 1.5}, "confidence must be between 0 and 1, not 1.5"),
        ({"day_error": 0.0}, "day_error must be 0.001 mm or more, not 0 mm"),
        ({"block": 30.0}, "the record must have readings on at least 3 days for their scatter, not on 1"),
    ],
)
def test_impossible_wishes_are_refused(options: dict[str, Any], sentence: str) -> None:
    time, clearance = record(10, 0.1, last=5.0)
    with pytest.raises(SpecificationError, match=f"^{re.escape(sentence)}$"):
        over_days(time, clearance, LIMITS, **options)
