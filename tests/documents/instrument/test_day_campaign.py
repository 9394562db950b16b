"""The campaign of the day's error: its tasks, what is kept of them, and how they are summed up."""

import json
from pathlib import Path

import pytest
from benchmarks import calibration_coverage, day_alarms, days
from benchmarks.day_limits import likelihood_ratio


def test_every_part_has_tasks_each_once() -> None:
    for part in days.FIRST_SEEDS:
        tasks = days.tasks_of(part)
        assert len(set(map(json.dumps, tasks))) == len(tasks) > 0


def test_what_is_measured_is_kept_until_the_code_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def measured(task: days.Task, folder: Path) -> list[float]:
        calls.append(task)
        return [1.5]

    monkeypatch.setattr(days, "measured_one", measured)
    task = days.tasks_of("alarms")[0]
    assert days.kept(task, tmp_path) == days.kept(task, tmp_path) == [1.5]
    assert calls == [task]
    monkeypatch.setattr(days, "digest_of", lambda part: "other code")
    assert days.kept(task, tmp_path) == [1.5]
    assert calls == [task, task]


def test_the_files_of_every_part_are_there() -> None:
    root = days.HERE.parent
    for patterns in days.CODE.values():
        for pattern in patterns:
            assert any(root.glob(pattern)), pattern


def test_no_test_tells_more_than_is_possible() -> None:
    shares = likelihood_ratio(0.13, 1)
    bounds = [day_alarms.possible(kind, 0.13, axle=False) for kind in day_alarms.KINDS]
    assert all(share <= bound + 0.001 for share, bound in zip(shares, bounds, strict=True))  # shares are counted
    assert shares[0] > 0.98
    assert 0.8 < shares[1] < bounds[1] - 0.02  # to look for each day costs something
    for kind, bound in zip(day_alarms.KINDS, bounds, strict=True):
        assert day_alarms.possible(kind, 0.13, axle=True) > bound


def test_sensors_that_hold_too_little_without_a_word_are_counted() -> None:
    quiet = {"warned": False, "step": False, "possible": False, "noticed": False, "beyond": [0, 9]}
    found = [
        {"inside": [0.95, 0.90], "half_width": [0.1, 0.2], **quiet, "warned": True, "step": True, "possible": True},
        {"inside": [0.95, 0.90], "half_width": [0.1, 0.2], **quiet, "beyond": [1, 9]},
        {"inside": None, "half_width": None, **quiet, "warned": True, "beyond": [0, 0]},
    ]
    row = calibration_coverage.summed(calibration_coverage.CASES[0], found)
    assert (row["silent"], row["warned"], row["step"], row["refused"], row["count"]) == (1, 2, 1, 1, 3)
    assert row["inside"] == [0.95, 0.9]
    assert (row["possible"], row["noticed"], row["beyond"]) == (1, 0, [1, 18])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gain +15 %", "gain -20 %", "error of a day an offset"])
def test_intervals_hold_or_a_warning_is_told(name: str) -> None:
    (case,) = (one for one in calibration_coverage.CASES if one.name == name)
    found = calibration_coverage.summed(case, [calibration_coverage.one_sensor(case, seed) for seed in (3, 4)])
    assert min(found["inside"]) >= calibration_coverage.ENOUGH or found["warned"] == 2
