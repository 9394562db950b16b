"""The page on how exploration grows says what is recorded, and its sweep is the one that it names."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from benchmarks import explore


def test_the_document_shows_what_is_recorded() -> None:
    assert explore.DOCUMENT.read_text(encoding="utf-8") == explore.document(explore.recorded())


def test_the_sweep_has_a_thousand_designs() -> None:
    assert explore.sweep(1000) == explore.SWEEP
    for designs in (1, 24, 120, 999):
        cut = explore.sweep(designs)
        assert list(cut) == list(explore.SWEEP)
        assert all(set(values) <= set(explore.SWEEP[key]) for key, values in cut.items())
        command = explore.command(cut, Path("out"))
        assert command.count("-p") == len(cut)


def test_both_fronts_are_the_same_in_the_record() -> None:
    one, two = explore.recorded().runs
    assert (one.jobs, two.jobs, one.front) == (1, 2, two.front)


def test_times_on_the_clock_stand_only_where_they_were_measured() -> None:
    """200 s for two processes that were busy for 380 s are 95 % of both."""
    runs = tuple(
        explore.Run(jobs=jobs, designs=1000, processor=380.0, elapsed=400.0 / jobs, front="1" * 64) for jobs in (1, 2)
    )
    figures = explore.Figures(runs=runs, alone=3.8, task_bytes=900, result_bytes=1000, scheduler=0.0004)
    page = explore.document(figures)
    assert "| 2 | 1,000 | 380 s | 380 ms | 200 s | 95 % |" in page
    assert "takes 0.40 ms; so it feeds about 1,000 workers" in " ".join(page.split())
    assert "or 1 % of the whole" in " ".join(page.split())
    busy = replace(figures, runs=tuple(replace(run, elapsed=None) for run in runs), scheduler=None)
    assert "on the clock |" not in explore.document(busy)
    assert "feeds about 400 workers" in " ".join(explore.document(busy).split())
    other = replace(figures, runs=(runs[0], replace(runs[1], front="2" * 64)))
    assert "**different fronts**" in explore.document(other)


@pytest.mark.slow
def test_four_ways_to_the_same_front(capsys: pytest.CaptureFixture[str]) -> None:
    explore.main(["--same", "--designs", "16"])
    lines = capsys.readouterr().out.splitlines()[-4:]
    assert len({line.split()[0] for line in lines}) == 1
