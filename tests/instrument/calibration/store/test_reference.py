"""Reference targets: by their own uncertainty they give the curve of the day, which scatter hides."""

from pathlib import Path

import numpy as np
import pytest
from tests.instrument.calibration.bayesian import FIRST, RANGES, TRUE, TYPE, measured
from tests.instrument.calibration.measuring import readings, write_csv

from sosmith.gen.calibration.fit import Measurements
from sosmith.instrument.calibration.bayesian_fit import bayesian_fit
from sosmith.instrument.calibration.measurement_store import open_store
from sosmith.instrument.calibration.self_updating import add, calibration_of
from sosmith.instrument.calibration.store.reference import by_hand, reference
from sosmith.instrument.calibration.uncertainty import of_posterior
from sosmith.model.errors import SpecificationError

DAYS = 8
ERROR = 0.15
"""Error of the new day in mm: smooth over the clearance."""


def error(d: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
    return ERROR * np.cos(d / 4.0)


def with_targets(stated: float) -> Measurements:
    """Days of a depot, and three targets on a morning whose error is ours to know."""
    before = measured(DAYS, 15, scatter=0.45, systematic=0.1, seed=5)
    V, T = np.array([1.5, 5.0, 8.5]), np.full(3, 25.0)
    d = TRUE(V, T)
    columns = (np.concatenate(pair) for pair in ((before.clearance, d + error(d)), (before.voltage, V)))
    uncertainty = np.zeros((3, len(before) + 3))
    uncertainty[0, -3:] = stated
    return Measurements(
        *columns,
        np.concatenate((before.temperature, T)),
        "m.csv",
        (*before.days, *[FIRST + DAYS] * 3),
        uncertainty,
    )


def test_targets_give_the_curve_of_the_day_by_their_own_uncertainty() -> None:
    V, T = np.linspace(1.5, 8.5, 15), np.full(15, 25.0)
    now = TRUE(V, T) + error(TRUE(V, T))
    off, half = {}, {}
    for stated in (0.0, 0.02):
        rows = with_targets(stated)
        made = bayesian_fit(rows, TYPE, FIRST + DAYS, RANGES)
        off[stated] = np.abs(made.fit.polynomial(V, T) - now)
        half[stated] = of_posterior(rows, made).half_width(V, T)
        assert np.all(off[stated] < 1.5 * half[stated])
    assert off[0.02].max() < 0.08
    assert off[0.0].max() > 0.12
    assert half[0.02].mean() < 0.5 * half[0.0].mean()


def test_uncertain_voltages_and_temperatures_count_by_the_slope_of_the_type() -> None:
    u = np.array([[0.02, 0.0, 0.0, 0.0], [0.0, 0.1, 0.0, 0.0], [0.0, 0.0, 5.0, 0.0]])
    V, T = np.full(4, 5.0), np.full(4, 20.0)
    rise = TYPE.polynomial()
    by_voltage = float((rise(np.array(5.001), np.array(20.0)) - rise(np.array(4.999), np.array(20.0))) / 0.002)
    by_heat = float(rise(np.array(5.0), np.array(20.5)) - rise(np.array(5.0), np.array(19.5)))
    expected = [0.02**2, (0.1 * by_voltage) ** 2, (5 * by_heat) ** 2, 0.0]
    assert TYPE.known_variance(V, T, u) == pytest.approx(expected, rel=1e-6)


@pytest.mark.slow
def test_the_routine_of_a_morning(tmp_path: Path) -> None:
    with open_store(tmp_path / "c.db", create=True) as store:
        add(store, "left", write_csv(tmp_path / "a.csv", readings(60)), "2024-03-01", method="bayes")
        rows = [(2.2, 2.0, 25.0), (4.6, 5.0, 25.0), (8.1, 8.0, 25.0)]
        path, content = by_hand("2024-03-02", rows)
        found = reference(store, "left", path, "2024-03-02", 0.02, content=content)
        assert [one.reading.values for one in found.targets] == rows
        assert {one.reading.uncertainty for one in found.targets} == {(0.02, 0.0, 0.0)}
        assert all(one.after[1] < one.before[1] for one in found.targets)
        stored = store.measurements("left")
        assert [one.source for one in stored[60:]] == ["by hand, 2024-03-02.csv"] * 3
        assert [one.reading.uncertainty[0] for one in stored[58:]] == [0.0, 0.0, 0.02, 0.02, 0.02]
        assert calibration_of(store, "left").version == store.versions("left")[1]
        with pytest.raises(SpecificationError, match=r"c\.db: the sensor must be one of left, not right$"):
            reference(store, "right", path, "2024-03-02", 0.02, content=content)
        path, content = by_hand("2024-03-03", [(20.0, 5.0, 25.0)])
        message = r"^by hand, 2024-03-03\.csv, line 2: clearance_mm must be 0 to 16 mm, not 20 \(in micrometres\?\)$"
        with pytest.raises(SpecificationError, match=message):
            reference(store, "left", path, "2024-03-03", 0.02, content=content)
        path, content = by_hand("2024-03-03", [*rows[:2], (4.1, 8.1, 25.0)])
        wrong = reference(store, "left", path, "2024-03-03", 0.02, content=content, surprising=True)
        read = wrong.targets[2].before[0]
        assert wrong.warnings == (
            f"the target of 4.1 mm reads {read:.3f} mm by the calibration before, too far off for an error of a day; "
            "sosmith calibrate withdraw if it was another",
        )
        assert found.warnings == ()
