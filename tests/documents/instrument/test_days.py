"""The page of the day's own error is what the record gives, and the record has what is claimed of it."""

import json

import pytest
from benchmarks import calibration_coverage, day_advice, day_bench, day_service, days
from benchmarks.day_page import GOALS, SERVICE_GOALS, page


@pytest.fixture(scope="module")
def record() -> dict[str, list[dict[str, object]]]:
    found: dict[str, list[dict[str, object]]] = json.loads(days.RECORD.read_text(encoding="utf-8"))
    return found


def test_the_page_is_what_the_record_gives(record: dict[str, list[dict[str, object]]]) -> None:
    assert days.PAGE.read_text(encoding="utf-8") == page(record)


def test_every_part_was_measured_in_full(record: dict[str, list[dict[str, object]]]) -> None:
    assert list(record) == list(days.FIRST_SEEDS)
    bench, service = record["bench"], record["service"]
    assert len(bench) == len(day_bench.RUNS) * len(day_bench.TARGETS)
    assert {row["count"] for row in bench} == {days.SEEDS}
    assert len(service) == 2 * len(day_service.WAYS)
    assert {(row["count"], row["axles"]) for row in service} == {(days.SEEDS, day_service.THROUGH_HARDWARE)}
    assert [row["case"] for row in record["coverage"]] == [case.name for case in calibration_coverage.CASES]
    assert len(record["advice"]) == len(day_advice.CASES) * day_advice.EACH


def test_what_was_wanted_of_targets_and_filter_is_reached(record: dict[str, list[dict[str, object]]]) -> None:
    for row in record["bench"]:
        goal = GOALS.get((str(row["run"]), str(row["targets"])), 0.0)
        assert row["refused"] == 0
        for by in ("accuracy", "hardware"):
            assert float(str(row[by])) >= goal
    for row in record["service"]:
        assert row["refused"] == 0
        assert float(str(row["off"])) < 0.01
        if row["way"] == "filter":
            assert float(str(row["accuracy"])) >= SERVICE_GOALS[bool(row["targets"])]
            assert 0.93 <= float(str(row["inside"])) <= 0.98


def test_a_part_is_summed_over_its_seeds() -> None:
    rows = [
        {"run": "a", "accuracy": value, "hardware": value + 0.01, "order": 2, "bound": 0.1 * value, "seed": k}
        for k, value in enumerate((1.0, 3.0))
    ]
    (one,) = days.summed(rows, ("run",))
    assert (one["run"], one["count"], one["accuracy"], one["worst"], one["off"]) == ("a", 2, 2.0, 1.0, 0.01)
    assert (one["accuracy_error"], one["bound"], one["refused"]) == (1.0, 0.30000000000000004, 0)
