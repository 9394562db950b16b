"""A monitor over hours of simulated time: memory does not grow, and the document shows the recorded day."""

from dataclasses import replace

import pytest
from benchmarks import load, speed_page


def test_the_document_shows_the_recorded_day() -> None:
    (row,) = load.BENCHMARK.recorded()
    assert speed_page.shown("load") == load.section([row])
    assert (row.hours, row.channels) == (24, 12)
    assert load.losses([], [row]) == []
    grown = replace(row, first=100.0, last=105.1)
    assert load.losses([], [grown]) == ["memory must grow by at most 5 MB after the first hour, not by 5.1 MB"]


@pytest.mark.slow
def test_memory_does_not_grow_over_six_hours() -> None:
    row = load.run(6)
    assert row.results == pytest.approx(6 * 3600 * 12, rel=0.01)
    assert row.alarms > 100
    assert load.losses([], [row]) == []
