"""Explorations of chains: keys of the whole and of a stage, the figures of each design, and what is proven of them."""

from __future__ import annotations

import csv
import random
import re
from pathlib import Path
from typing import Any

import pytest
from tests.gen.chain import chains, rising
from tests.gen.chain.chains import PLAIN, instrument

import sosmith
from sosmith import SpecificationError
from sosmith.gen.chain.report.provenance import chain_cost
from sosmith.gen.specification.exact_values import exact
from sosmith.gen.specification.toml_text import toml_text
from sosmith.instrument.scenarios.traces import ChosenTraces
from sosmith.sim.exploration.grid import Subject, changed

SWEEP: dict[str, list[Any]] = {
    "stage.double.architecture": ["folded"],
    "output.bits": [8, 10],
    "output.max_error": [0.0011, 0.005],
}
"""Four combinations; 8 bits have an LSB of 0.0078, so one of them cannot keep within 0.0011."""


def explored(folder: Path, **changes: Any) -> sosmith.Exploration:
    return sosmith.explore(PLAIN, **({"parameters": SWEEP, "folder": folder, "samples": 300, "jobs": 1} | changes))


@pytest.fixture(scope="module", name="found")
def exploration(tmp_path_factory: pytest.TempPathFactory) -> sosmith.Exploration:
    return explored(tmp_path_factory.mktemp("explored"))


@pytest.mark.slow
def test_figures_are_those_of_the_chain(found: sosmith.Exploration) -> None:
    point = found.points[3]
    assert point["changes"] == {"stage.double.architecture": "folded", "output.bits": 10, "output.max_error": 0.005}
    chain = sosmith.design_chain(changed(PLAIN, point["changes"]))
    cost = chain_cost(chain.core)
    assert point["error"]["bound"] == chain.bound
    assert 0 < point["error"]["max_abs"] <= chain.bound
    assert (point["cost"]["luts"], point["cost"]["device"]) == (cost["luts"], cost["device"])
    assert (point["architecture"], point["cycles_per_sample"]) == ("folded", chain.core.clocks_per_sample)
    assert (point["passed"], point["shortfalls"]) == (True, [])


def test_the_front_and_what_is_refused(found: sosmith.Exploration) -> None:
    refused = [point for point in found.points if point["refused"] is not None]
    assert {(p["changes"]["output.bits"], p["changes"]["output.max_error"]) for p in refused} == {(8, 0.0011)}
    assert len(refused) == 1
    assert found.front
    bounds = [point["error"]["bound"] for point in found.front]
    assert bounds == sorted(bounds, reverse=True)
    (table,) = found.tables()
    assert table.head == (
        "realization",
        "architecture",
        "double.architecture",
        "bits",
        "max_error",
        "bound",
        "cost",
        "clocks",
    )
    with (found.folder / "points.csv").open(encoding="utf-8") as file:
        assert [row["stage.double.architecture"] for row in csv.DictReader(file)] == ["folded"] * 4


def test_what_is_on_record_is_not_done_again(found: sosmith.Exploration, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sosmith.sim.exploration.processes.evaluate", None)
    assert explored(found.folder).points == found.points


def test_a_file_of_taps_that_changes_is_another_design(tmp_path: Path) -> None:
    """And the same file is not: what a specification names is part of it, in each stage and each table."""
    stages = [*PLAIN["stage"], {"name": "last", "kind": "fir", "taps_file": "taps.csv"}]
    (tmp_path / "rx.toml").write_text(toml_text(exact(PLAIN | {"stage": stages})), encoding="utf-8")
    keys = []
    for taps in ("0.5", "0.5", "0.25"):
        (tmp_path / "taps.csv").write_text(f"{taps}\n0.5\n0.125\n", encoding="utf-8")
        spec = sosmith.ChainSpecification.load(tmp_path / "rx.toml").checked
        subject = Subject(spec=spec, core=None, samples=10, seed=1, board=None, traces=ChosenTraces(None))
        keys.append(subject.task({"output.bits": 12}).key)
    assert keys[0] == keys[1] != keys[2]


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        (
            {"stage.slo.order": [2, 3]},
            "a parameter of a stage must be stage.NAME.KEY with one of the names slow, double, out, not "
            "stage.slo.order (did you mean slow?)",
        ),
        (
            {"stage.slow": [2, 3]},
            "a parameter of a stage must be stage.NAME.KEY with one of the names slow, double, out, not stage.slow",
        ),
        (
            {"stage.slow.order": [2, 99]},
            "specification: stage[0].order must be a whole number from 1 to 12, not 99",
        ),
    ],
)
def test_a_key_or_value_that_no_stage_has_is_refused(parameters: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        explored(tmp_path, parameters=parameters)


def test_a_core_of_a_chain_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SpecificationError, match=r"^core must be left out with a chain of stages, not filter$"):
        explored(tmp_path, core="filter")


@pytest.mark.slow
def test_by_default_the_allowed_error_is_swept(tmp_path: Path) -> None:
    found = sosmith.explore(instrument(), folder=tmp_path, samples=300, jobs=1)
    assert {key: len(values) for key, values in found.outcome.parameters.items()} == {"output.max_error": 3}
    assert found.front


@pytest.mark.slow
def test_stages_that_are_chosen(tmp_path: Path) -> None:
    """A stage of the kind auto: its limits are keys like others, and the dearer ones cost more."""
    auto = {"name": "down", "kind": "auto", "decimate": 8, "passband_edge": 300.0, "passband_loss": 0.1}
    tree = {**PLAIN, "stage": [{**auto, "stopband_loss": 40.0}], "hardware": {"clock": 1e6}}
    sweep = {"stage.down.stopband_loss": [40.0, 50.0]}
    found = sosmith.explore(tree, sweep, folder=tmp_path, samples=2000, jobs=1)
    costs = [point["cost"]["value"] for point in found.points]
    assert costs[0] < costs[1]


@pytest.mark.slow
@pytest.mark.parametrize("tree", [PLAIN, rising.UP])
def test_the_front_is_simulated_and_proven(tree: dict[str, Any], tmp_path: Path) -> None:
    found = sosmith.explore(
        tree, {"output.bits": [9, 10]}, folder=tmp_path, samples=200, jobs=1, simulate=True, simulator="icarus"
    )
    assert found.front
    for point in found.front:
        place = (tmp_path / point["report"]).parent
        assert point["report_passed"]
        proof = sosmith.ChainCertificate.load(place / "rx.certificate.json").verify(files=place)
        assert float(proof.bound) == point["error"]["bound"]
        assert sosmith.compare([place, place]).passed


@pytest.mark.slow
def test_cells_are_counted_after_synthesis(tmp_path: Path) -> None:
    found = sosmith.explore(PLAIN, {"output.bits": [9, 10]}, folder=tmp_path, samples=100, jobs=1, board="icebreaker")
    for point in found.points:
        assert (point["cost"]["source"], point["cost"]["board"]) == ("synthesis", "icebreaker")
        assert 0 < point["cost"]["luts"] < 2000


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_random_chains(seed: int, tmp_path: Path) -> None:
    tree = chains.draw(seed) if seed % 2 else rising.draw(seed)
    bits = tree["output"]["bits"]
    sweep = {
        "output.bits": [bits, bits + 1],
        f"stage.{random.Random(seed).choice(tree['stage'])['name']}.architecture": ["auto"],
    }
    for point in sosmith.explore(tree, sweep, folder=tmp_path, samples=400, jobs=1).points:
        chain = sosmith.design_chain(changed(tree, point["changes"]))
        assert point["refused"] is None
        assert point["error"]["max_abs"] <= point["error"]["bound"] == chain.bound
        assert point["passed"]
