"""The wear campaign: its document is what its run gave, and the hardware in it is as exact as it says."""

import json
import re
import subprocess
import sys
import tomllib
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from examples.wear_campaign import bench, campaign, hardware, methods, reloads, ride, week
from examples.wear_campaign.bench import PAPER_FILTER
from examples.wear_campaign.document import document
from examples.wear_campaign.methods_document import gain_with_share
from examples.wear_campaign.spread import spread
from scipy import signal

from sosmith.gen.reload.reload import check_swap
from sosmith.gen.specification.specification import load
from sosmith.gen.stimuli.core import bench_of
from sosmith.instrument.scenarios.file import emulate_file, load_scenario
from sosmith.model.polynomial import EQUATION_5A

ROOT = Path(__file__).parents[2]
HERE = ROOT / "examples" / "wear_campaign"
OFF = 0.01
"""Points of accuracy that the hardware may be off the golden chain."""


def outcome() -> dict[str, Any]:
    result: dict[str, Any] = json.loads((HERE / "outcome.json").read_text(encoding="utf-8"))
    return result


def test_the_document_says_what_came_out() -> None:
    assert (ROOT / "docs" / "campaign.md").read_text(encoding="utf-8") == document(outcome())


def test_what_came_out_is_of_these_settings() -> None:
    assert outcome()["settings"] == tomllib.loads((HERE / "campaign.toml").read_text(encoding="utf-8"))


def test_the_means_are_those_of_the_recorded_seeds() -> None:
    found = outcome()
    rows = [*found["bench"]["runs"], *found["bench"]["others"]]
    assert len(rows) == 4 + 2
    for row in rows:
        values = np.array(row["values"])
        assert values.shape == (found["settings"]["seeds"], 2)
        for what, column in zip(("unfiltered", "golden"), values.T, strict=True):
            assert row[what] == pytest.approx(spread(column.tolist(), found["settings"]["confidence"]), rel=1e-12)


def test_the_figures_of_methods_are_those_of_the_recorded_seeds() -> None:
    found = outcome()
    rows = found["methods"]
    assert [(row["case"], row["sensor"]) for row in rows[:9]] == [
        (case, sensor)
        for sensor in ("equation_5a", "equation_4", "coil")
        for case in ("bench_43_50", "bench_92_96", "a_week_in_service")
    ]
    assert len(rows) == 9 + 8
    for row in rows:
        for method, figures in row["methods"].items():
            seeds = found["settings"]["methods"]["variant_seeds"] if "," in row["case"] else found["settings"]["seeds"]
            assert len(figures["accuracy"]) == seeds
            assert max(map(len, figures.values())) == seeds  # fewer intervals: no fit on any day of a week
            expected = spread(figures["accuracy"], found["settings"]["confidence"])
            assert row["accuracy"][method] == pytest.approx(expected, rel=1e-12)


def test_the_first_seeds_of_the_rule_alone_are_those_of_the_methods() -> None:
    found = outcome()
    benches = [row for row in found["methods"] if row["case"] in found["settings"]["bench"]["scenarios"]]
    assert len(found["rule"]) == len(benches) == 6
    for alone, row in zip(found["rule"], benches, strict=True):
        assert (alone["case"], alone["sensor"]) == (row["case"], row["sensor"])
        assert len(alone["accuracy"]) == len(alone["order"]) == found["settings"]["methods"]["rule_seeds"]
        paper = row["methods"]["paper"]
        assert alone["accuracy"][: len(paper["accuracy"])] == pytest.approx(paper["accuracy"], abs=2e-4)
        assert alone["order"][: len(paper["order"])] == paper["order"]


def test_a_gain_with_the_share_of_many_seeds_is_that_of_both_kinds_of_fits() -> None:
    def row(order: list[int], apart: list[float]) -> dict[str, Any]:
        paper = {"accuracy": [90.0] * len(apart), "order": order}
        return {"methods": {"paper": paper, "bayes": {"accuracy": [90.0 + one for one in apart]}}}

    many = np.array([True] * 30 + [False] * 70)
    mean, error = gain_with_share(many, row([1, 1, 2, 2], [9.0, 11.0, -1.0, 1.0]))
    assert mean == pytest.approx(0.3 * 10)
    assert error == pytest.approx(np.sqrt(0.3**2 * 1 + 0.7**2 * 1 + 10**2 * 0.3 * 0.7 / 100))
    assert gain_with_share(np.zeros(100, bool), row([2, 2], [1.0, 3.0])) == pytest.approx((2.0, 1.0))
    # the same share as of the few: their mean gain
    same, _ = gain_with_share(np.array([True, False]), row([1, 1, 2, 2], [9.0, 11.0, -1.0, 1.0]))
    assert same == pytest.approx(5.0)


def test_forty_seeds_know_the_gains_within_a_kind_of_fit() -> None:
    """That is why the other methods have fewer seeds than the rule."""
    found = outcome()
    benches = [row for row in found["methods"] if row["case"] in found["settings"]["bench"]["scenarios"]]
    for alone, row in zip(found["rule"], benches, strict=True):
        mean, error = gain_with_share(np.array(alone["order"]) == 1, row)
        assert error < 0.5
        assert -0.2 < mean < 6.0


@pytest.mark.slow
@pytest.mark.parametrize("number", [4, pytest.param(8, marks=pytest.mark.slow)])
def test_methods_give_the_recorded_figures_again(number: int, tmp_path: Path) -> None:
    """The first seeds of a bench, and of a week with the coil."""
    settings = outcome()["settings"] | {"seeds": 2}
    names = [*settings["bench"]["scenarios"], settings["week"]["scenario"]]
    scenarios = {name: load_scenario(campaign.SCENARIOS / f"{name}.toml") for name in names}
    table = outcome()["ride"]["filters"][-1]["table"]
    made = methods.figures(methods.cases(settings, scenarios, table, tmp_path)[number], 0.95, lambda seed: None)
    recorded = outcome()["methods"][number]
    assert (made["case"], made["sensor"]) == (recorded["case"], recorded["sensor"])
    for method, figures in made["methods"].items():
        for figure, values in figures.items():
            assert values == pytest.approx(recorded["methods"][method][figure][:2], abs=2e-4), (method, figure)


@pytest.mark.slow
def test_intervals_are_held_against_every_day(tmp_path: Path) -> None:
    settings = tomllib.loads((HERE / "campaign.toml").read_text(encoding="utf-8"))
    stated = hardware.uncertainty_table(settings["bench"]["uncertainty"])
    calibration = hardware.calibration_table(EQUATION_5A)
    core = hardware.instrument(tmp_path, "bench", 6.0, calibration, PAPER_FILTER, uncertainty=stated)
    scenario = load_scenario(campaign.SCENARIOS / "bench_43_50.toml")
    made = methods.by_bayes(methods.measured(scenario, 1), scenario.document.start.toordinal() + 10)
    days = [emulate_file(methods.on_day(scenario, day), bench_of(core), seed=1) for day in range(10, 16)]
    assert np.array_equal(days[0].truth, days[1].truth)
    alone = [methods.judged(made, day, core) for day in days]
    every = methods.judged(made, days[0], core, days[1:])
    assert len({one["inside"] for one in alone}) > 1
    assert every["inside"] == pytest.approx(np.mean([one["inside"] for one in alone]))
    assert every["accuracy"] == alone[0]["accuracy"]


def test_outliers_are_as_many_as_stated() -> None:
    scenario = load_scenario(campaign.SCENARIOS / "bench_43_50.toml")
    clean, spoilt = methods.measured(scenario, 1), methods.measured(scenario, 1, 0.05)
    off = np.abs(clean.clearance - spoilt.clearance)
    assert 0.03 < np.mean(off > 0) < 0.07
    assert off.max() == pytest.approx(3.0)
    kept = methods.until(clean, min(clean.days))
    assert len(kept) == clean.days.count(min(clean.days))


def test_a_filter_that_is_not_exact_is_called_so() -> None:
    found = outcome()
    found["bench"]["runs"][0]["simulated"]["bit_exact"] = False
    assert "NOT EVERY SAMPLE" in document(found)
    assert "NOT" not in document(outcome())


@pytest.mark.slow
def test_the_bench_from_depot_to_hardware(tmp_path: Path) -> None:
    settings = tomllib.loads((HERE / "campaign.toml").read_text(encoding="utf-8"))
    settings |= {"seeds": 2, "simulator": "icarus"}
    settings["bench"] |= {"scenarios": ["bench_43_50"], "others": []}
    told: list[tuple[str, int, int]] = []
    found, series = campaign.bench_campaign(settings, tmp_path, lambda *what: told.append(what))
    assert [row["filter"] for row in found["runs"]] == ["the paper's", "from spectra"]
    for row in found["runs"]:
        assert row["simulated"]["bit_exact"]
        assert 0 < row["hardware_off"] < OFF
        assert sum(some["seeds"] for some in row["by_orders"]) == 2
    recorded = {row["filter"]: row for row in outcome()["bench"]["runs"] if row["scenario"] == "bench_43_50"}
    for row in found["runs"]:
        np.testing.assert_allclose(row["values"], recorded[row["filter"]]["values"][:2], rtol=1e-12)
        assert row["simulated"].keys() == recorded[row["filter"]]["simulated"].keys()
        for what, value in recorded[row["filter"]]["simulated"].items():
            assert row["simulated"][what] == pytest.approx(value, rel=1e-9), what
    assert load(tmp_path / "bench_43_50" / "bench_43_50_spectra.toml").filter.passband_edge is not None
    assert len(series["bench_43_50"]["time"]) == found["runs"][0]["simulated"]["samples"]
    assert any(total == 2 for _, _, total in told)


def test_each_source_of_error_is_taken_away() -> None:
    scenario = load_scenario(ROOT / "examples" / "scenarios" / "bench_43_50.toml")
    quiet = bench.without(scenario, "noise", "systematic")
    assert (quiet.sensors.inductive.noise, quiet.sensors.thermometer.noise) == (0.0, 0.0)
    assert quiet.sensors.inductive.systematic_error.rms == 0.0
    assert bench.without(scenario, "noise").sensors.inductive.systematic_error.rms > 0
    assert bench.without(scenario, "systematic").sensors.inductive.noise > 0


def test_the_exact_filter_loses_at_the_edge_what_it_is_to_lose() -> None:
    (cutoff,) = re.findall(r"cutoff = (\S+)", ride.prewarped(7, 10.0, 0.02, 100.0))
    sos = signal.butter(7, float(cutoff), fs=100.0, output="sos")
    _, response = signal.sosfreqz(sos, [10.0], fs=100.0)
    assert -20 * np.log10(np.abs(response[0])) == pytest.approx(0.02, rel=1e-6)


@pytest.mark.slow
def test_the_interval_of_a_mean_holds_it_as_often_as_it_says() -> None:
    rng = np.random.default_rng(7)
    held = [found["low"] <= 5 <= found["high"] for found in (spread(rng.normal(5, 2, 12), 0.9) for _ in range(2000))]
    assert np.mean(held) == pytest.approx(0.9, abs=0.02)
    runs = spread(list(range(101)), 0.9)
    assert (runs["mean"], runs["run_low"], runs["run_high"]) == pytest.approx((50, 5, 95), abs=1e-12)


@pytest.mark.slow
def test_too_few_seeds_are_refused(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "examples.wear_campaign", "--seeds", "1", "-o", str(tmp_path / "out")]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.endswith("error: --seeds must be at least 2, not 1\n")


@pytest.mark.slow
def test_the_whole_campaign_gives_the_same_again(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "examples.wear_campaign", "-o", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, check=True)
    assert (tmp_path / "campaign.md").read_bytes() == (ROOT / "docs" / "campaign.md").read_bytes()
    for name in ("bench", "runs", "ride", "week"):
        picture = f"campaign_{name}.svg"
        assert (tmp_path / "images" / picture).read_bytes() == (ROOT / "docs" / "images" / picture).read_bytes()


@pytest.mark.slow
def test_a_week_s_reloads_are_those_recorded(tmp_path: Path) -> None:
    """One week: what is refused leaves the active set, and the next swap starts from that."""
    settings = outcome()["settings"] | {"seeds": 1}
    settings["methods"] = settings["methods"] | {"sensors": ["equation_4"]}
    scenario = load_scenario(campaign.SCENARIOS / "a_week_in_service.toml")
    table = outcome()["ride"]["filters"][-1]["table"]
    (made,) = reloads.all_weeks(settings, scenario, table, tmp_path, lambda *_: None)
    (recorded,) = [one for one in outcome()["reloads"] if one["sensor"] == "equation_4"]
    assert made["mornings"] == 7
    assert made["proven"] + len(made["kept"]) == 7
    assert 0 < made["bound"] <= recorded["bound"] <= float(week.SET_ERROR)
    assert set(made["kept"]) <= set(recorded["kept"])


def test_every_reload_is_proven_or_refused_with_its_reason() -> None:
    found = outcome()
    days = 7
    assert [one["sensor"] for one in found["reloads"]] == found["settings"]["methods"]["sensors"]
    for one in found["reloads"]:
        assert one["mornings"] == days * found["settings"]["seeds"]
        assert one["proven"] + len(one["kept"]) == one["mornings"]
        assert one["bound"] <= float(week.SET_ERROR)


@pytest.mark.slow
def test_a_refused_reload_keeps_the_active_set(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a tight limit for its sets, some mornings are refused; each swap starts from the last proven."""
    scenario = load_scenario(campaign.SCENARIOS / "a_week_in_service.toml")
    table = outcome()["ride"]["filters"][-1]["table"]
    core = hardware.instrument(
        tmp_path, "kept", 100.0, hardware.calibration_table(EQUATION_5A), table, reload=True, max_error=week.MAX_ERROR
    )
    starts, active = [], []

    def watched(hardware: Any, before: Any, made: Any) -> Any:
        starts.append((before, active[-1] if active else None))
        swap = check_swap(hardware, before, made)
        active.append(swap.new_set)
        return swap

    monkeypatch.setattr(reloads, "SET_ERROR", Fraction(265, 10**6))  # mm: those of this week have 257 to 271 nm
    monkeypatch.setattr(reloads, "check_swap", watched)
    mornings = reloads.one_week(core, scenario, 1)
    verdicts = [one["verdict"] for one in mornings]
    assert set(verdicts) == {"proven", "refused"}
    assert len(active) == verdicts.count("proven") > 1
    assert all(before is expected for before, expected in starts if expected is not None)
    refused = next(one["reason"] for one in mornings if one["verdict"] == "refused")
    assert refused.startswith("the set must keep its error within 265 nm, and is proven to ")
