"""A monitor over hours of simulated time, and how late it is: the document shows what was recorded."""

from dataclasses import replace

import pytest
from benchmarks import latency, load, speed_page


def test_the_document_shows_the_recorded_day() -> None:
    (row,) = load.BENCHMARK.recorded()
    assert speed_page.shown("load") == load.section([row])
    assert (row.hours, row.channels) == (24, 12)
    assert load.losses([], [row]) == []
    grown = replace(row, first=100.0, last=105.1)
    assert load.losses([], [grown]) == ["memory must grow by at most 5 MB after the first hour, not by 5.1 MB"]


def test_the_document_shows_the_recorded_latency() -> None:
    (row,) = latency.BENCHMARK.recorded()
    assert speed_page.shown("latency") == latency.section([row])
    assert (row.baud, row.channels, row.missed) == (3_000_000, 12, 0)
    assert row.results > 0.95 * latency.SECONDS * latency.RATE * latency.CHANNELS
    assert latency.losses([], [row]) == []
    expected = "all but one in a thousand results must be recorded within 250 ms, not 251 ms"
    assert latency.losses([], [replace(row, late=251.0)]) == [expected]


def test_a_moment_of_a_fast_line() -> None:
    row = latency.run(0.5)
    assert row.results > 0
    assert 0 < row.median <= row.late <= row.latest


@pytest.mark.slow
def test_memory_does_not_grow_over_six_hours() -> None:
    row = load.run(6)
    assert row.results == pytest.approx(6 * 3600 * 12, rel=0.01)
    assert row.alarms > 100
    assert load.losses([], [row]) == []
