"""The speeds: the document shows what was recorded, and a slower bench or model is noticed."""

from dataclasses import replace

import pytest
from benchmarks import design, model, random_designs, simulation, speed_page, studio


def test_the_document_shows_the_recorded_figures() -> None:
    assert speed_page.shown("simulation") == simulation.section(simulation.BENCHMARK.recorded())
    assert speed_page.shown("model") == model.section(model.BENCHMARK.recorded())
    assert speed_page.shown("design") == design.section(design.BENCHMARK.recorded())
    assert speed_page.shown("random_designs") == random_designs.section(random_designs.recorded())
    assert speed_page.shown("studio") == studio.section(studio.BENCHMARK.recorded())
    with pytest.raises(ValueError, match=r"speed\.md must have a section none$"):
        speed_page.shown("none")


def test_both_architectures_are_recorded_with_long_runs_at_the_speed_that_is_asked() -> None:
    rows = {row.architecture: row for row in simulation.BENCHMARK.recorded()}
    assert {name: row.samples for name, row in rows.items()} == {"parallel": 1_000_000, "folded": 60_000}
    assert all(row.ratio > 1.0 and row.build < simulation.BUILD for row in rows.values())


def test_one_and_twelve_channels_are_recorded_faster_than_scipy() -> None:
    rows = model.BENCHMARK.recorded()
    assert {(row.example, row.core, row.channels) for row in rows} == {
        (*core, channels) for core in model.CORES for channels in (1, 12)
    }
    assert all(row.ratio > 1 for row in rows)


def test_a_bench_that_has_become_slower_is_named() -> None:
    old = [replace(row, bare=100.0, bench=90.0, build=2.0) for row in simulation.BENCHMARK.recorded()]
    assert simulation.losses(old, [replace(row, bare=200.0, bench=154.0) for row in old]) == []
    slower = [replace(old[0], build=4.1), replace(old[1], bare=200.0, bench=152.0)]
    assert simulation.losses(old, slower) == [
        "folded: the bench must reach 0.77 of the bare loop's speed, not 0.76",
        "parallel: building for Verilator must take at most 4 s, not 4.1 s",
    ]


def test_a_model_that_has_become_slower_is_named() -> None:
    old = [replace(row, model=200.0, scipy=100.0) for row in model.BENCHMARK.recorded()]
    assert model.losses(old, [replace(row, model=152.0) for row in old]) == []
    slower = [replace(old[0], model=148.0), *old[1:]]
    name = "audio_lowpass, filter, 1 channels"
    assert model.losses(old, slower) == [f"{name}: the model must reach 1.50 of scipy's speed, not 1.48"]
    below = [replace(each, model=99.0) for each in old]
    old = [replace(each, model=105.0) for each in old]
    assert f"{name}: the model must reach 1.00 of scipy's speed, not 0.99" in model.losses(old, below)


def test_all_designs_are_recorded() -> None:
    rows = design.BENCHMARK.recorded()
    assert [(row.kind, row.order, row.cutoff) for row in rows] == design.CASES
    assert {*design.GOALS} <= {*design.CASES}


def test_a_design_that_has_become_slower_is_named() -> None:
    old = [replace(row, design=1.0, verification=0.5, recursion=0.1) for row in design.BENCHMARK.recorded()]
    assert design.losses(old, [replace(row, design=2.6, recursion=0.2) for row in old]) == []
    slower = [replace(old[0], design=1.4), replace(old[1], verification=1.5), *old[2:]]
    assert design.losses(old, slower) == [
        "lowpass, order 2, 0.0001: the design must reach 0.075 of the recursion's speed, not 0.071",
        "lowpass, order 2, 0.001: verification must take less than the design's 1.00 s, not 1.50 s",
    ]
    slow = [replace(row, design=9.0, recursion=0.9) for row in old]
    assert design.losses(old, slow) == [
        "bandpass, order 6, 0.0026, 0.0052: the design must take less than 8 s, not 9.0 s"
    ]


def test_a_random_design_that_is_slow_is_named_and_gaps_are_told() -> None:
    quick = random_designs.Design(2, "quick", "df1", 0.1, 0.4)
    rows = [quick, replace(quick, seed=4, name="long", design=30.0), replace(quick, seed=5, name="late", design=1.0)]
    assert [row.faults for row in rows] == [[], ["long: the design must take less than 30 s, not 30.0 s"], []]
    late = replace(rows[2], verification=1.5)
    assert late.faults == ["late: verification must take less than 1.00 s, not 1.50 s"]
    text = random_designs.section([*rows[:2], late])
    assert "| seeds up to 200 not measured yet, or stopped | 1, 3, 6 to 200 |" in text
    assert "| slowest design | 30.0 s (long) |" in text
    assert "| above 30 s, or verified more slowly than designed | 2 |" in text


def test_an_example_that_takes_too_long_in_the_studio_is_named() -> None:
    quick = studio.Times("quick", 1.0, 2.9, 1.0, 3.0)
    slow = studio.Times("slow", 1.0, 3.14, 1.0, 3.0)
    assert studio.losses([], [quick, slow]) == [
        "slow: a changed cutoff must be proven within 3 s of opening, not 3.1 s"
    ]
    assert "is not reached for slow here" in studio.section([quick, slow]).replace("\n", " ")
    assert "is reached for all of them here" in studio.section([quick]).replace("\n", " ")
    assert "| quick | 1.0 | 2.9 | 1.0 | 3.0 |\n" in studio.section([quick])
