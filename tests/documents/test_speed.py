"""The speeds: the document shows what was recorded, and a slower bench is noticed."""

from dataclasses import replace
from pathlib import Path

from benchmarks import simulation

ROOT = Path(__file__).parents[2]


def test_the_document_shows_the_recorded_figures() -> None:
    assert (ROOT / "docs" / "speed.md").read_text(encoding="utf-8") == simulation.document(simulation.recorded())


def test_both_architectures_are_recorded_with_long_runs() -> None:
    rows = {row.architecture: row for row in simulation.recorded()}
    assert {name: row.samples for name, row in rows.items()} == {"parallel": 1_000_000, "folded": 60_000}


def test_a_bench_that_has_become_slower_is_named() -> None:
    old = [replace(row, bare=100.0, bench=90.0) for row in simulation.recorded()]
    assert simulation.losses(old, [replace(row, bare=200.0, bench=154.0) for row in old]) == []
    slower = [old[0], replace(old[1], bare=200.0, bench=152.0)]
    assert simulation.losses(old, slower) == ["folded: the bench must reach 0.77 of the bare loop's speed, not 0.76"]
