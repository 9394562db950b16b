"""The page of the day's own error is what the record gives, and the record has what is claimed of it."""

import json
from typing import Any

import pytest
from benchmarks import calibration_coverage, day_advice, day_alarms, day_bench, day_service, days
from benchmarks.day_page import GOALS, SERVICE_GOALS, page


@pytest.fixture(scope="module")
def record() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(days.RECORD.read_text(encoding="utf-8"))
    return found


def test_the_page_is_what_the_record_gives(record: dict[str, Any]) -> None:
    assert days.PAGE.read_text(encoding="utf-8") == page(record)


def test_every_part_was_measured_in_full(record: dict[str, Any]) -> None:
    assert list(record) == list(days.FIRST_SEEDS)
    bench, service = record["bench"], record["service"]
    assert len(bench) == len(day_bench.RUNS) * len(day_bench.TARGETS)
    assert {row["count"] for row in bench} == {days.SEEDS}
    assert len(service) == 2 * len(day_service.WAYS)
    assert {row["count"] for row in service} == {days.SEEDS}
    assert [row["case"] for row in record["coverage"]] == [case.name for case in calibration_coverage.CASES]
    assert len(record["advice"]) == len(day_advice.CASES) * day_advice.EACH


def test_what_was_wanted_of_targets_and_filter_is_reached(record: dict[str, Any]) -> None:
    for row in record["bench"]:
        goal = GOALS.get((row["run"], row["targets"]), 0.0)
        assert row["refused"] == 0
        assert min(row["accuracy"], row["hardware"]) >= goal
    for row in record["service"]:
        assert row["refused"] == 0
        assert row["off"] < 0.01
        if row["way"] == "filter":
            assert min(row["accuracy"], row["hardware"]) >= SERVICE_GOALS[row["targets"]]


def test_intervals_hold_what_they_say_in_double_precision_and_by_the_hardware(record: dict[str, Any]) -> None:
    """Those without targets allow for ageing, which the emulated sensors do not do, and may hold more with the sum."""
    for row in record["bench"] + record["service"]:
        for by in ("inside", "inside_hardware"):
            assert row[by] >= 0.93, row
            assert row[by] <= 0.98 or (row.get("way"), row["targets"]) == ("filter and sum", False), row


def test_what_intervals_hold_too_much_is_the_drift_of_the_type(record: dict[str, Any]) -> None:
    rows = record["without drift"]
    assert {row["way"] for row in rows} == set(day_service.WAYS)
    assert {row["count"] for row in rows} == {days.SEEDS}
    every = {row["way"]: row for row in record["service"] if not row["targets"]}
    for row in rows:
        assert 0.92 <= row["inside"] <= 0.98, row
        assert row["inside"] <= every[row["way"]]["inside"], row


def test_no_sensor_fails_silently(record: dict[str, Any]) -> None:
    text = " ".join(days.PAGE.read_text(encoding="utf-8").split())
    assert (
        "In every row, intervals hold at least 92 % on both days on average, or every sensor whose intervals hold less "
        "is warned of." in text
    )
    for row in record["coverage"]:
        assert not row["silent"] or min(row["inside"]) >= calibration_coverage.ENOUGH, row
        doubtful = 0 < abs(next(case.step for case in calibration_coverage.CASES if case.name == row["case"])) < 0.5
        assert row["count"] == (days.OF_DOUBTFUL if doubtful else days.SENSORS)


def test_one_day_in_twenty_is_beyond_the_warning_limit_by_chance(record: dict[str, Any]) -> None:
    plain = next(row for row in record["coverage"] if row["case"] == "as its type")
    beyond, count = plain["beyond"]
    assert count == days.SENSORS * (calibration_coverage.DAYS - 1)
    assert 0.02 < beyond / count < 0.09


def test_plans_keep_their_promise(record: dict[str, Any]) -> None:
    made = [row for row in record["advice"] if "met" in row]
    assert len(made) >= 40
    assert sum(row["met"] for row in made) >= 0.8 * len(made)


def test_happenings_are_told_in_time_and_seldom_without_a_reason(record: dict[str, Any]) -> None:
    alarms = record["alarms"]
    for row in alarms["quiet"]:
        assert row["false"] <= day_alarms.ALLOWED * row["days"]
    for row in alarms["happenings"]:
        if row["axle"] or row["error"] < 0.1:
            assert row["told"] >= 0.95 * row["records"], row
    for row in alarms["limit"]:
        if row["offset"] == 0.25:
            assert row["risks"]["0.05"] > 0.95


def test_a_part_is_summed_over_its_seeds() -> None:
    rows = [
        {"targets": "three", "accuracy": value, "hardware": value, "order": 2, "bound": 0.1 * value, "seed": k}
        | {"days": 4, "refused": k, "off": 0.01 * k}
        for k, value in enumerate((1.0, 3.0))
    ]
    (one,) = days.summed(rows, ("targets",))
    assert (one["targets"], one["count"], one["accuracy"], one["worst"]) == ("three", 2, 2.0, 1.0)
    assert (one["accuracy_error"], one["bound"], one["refused"], one["sets"]) == (1.0, 0.30000000000000004, 1, 8)
    assert one["off"] == 0.01
