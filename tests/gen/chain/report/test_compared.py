"""Reports of chains beside each other and beside those of single cores."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.gen.chain import rising
from tests.gen.chain.chains import PLAIN, instrument

import sosmith
from sosmith.gen.chain.report.measures import aliases_entry, delay_entry, response_entry
from sosmith.gen.chain.report.provenance import chain_provenance
from sosmith.gen.chain.report.report import chain_summary
from sosmith.gen.chain.report.run import run_of
from sosmith.gen.chain.top import chain_interface
from sosmith.gen.output.core_facts import core_facts
from sosmith.gen.report.behaviour import aliases_entry as aliases_of_core
from sosmith.gen.report.provenance import hardware_cost, provenance_of
from sosmith.interface.inputs import traces_of
from sosmith.model.arrays import side_by_side

LOSSES = {"passband_loss": 0.1, "stopband_loss": 50.0}
TAPS = [0.25, 0.5, 0.25]
ALONE = {**PLAIN, "stage": [{"name": "f", "kind": "fir", "taps": TAPS, "decimate": 2}]}
FILTER = {**{key: PLAIN[key] for key in PLAIN if key != "stage"}, "filter": {"taps": TAPS, "decimate": 2}}


TREES = {"plain": PLAIN, "finer": {**PLAIN, "output": {**PLAIN["output"], "bits": 12}}, "alone": ALONE, "up": rising.UP}


@cache
def designed(name: str) -> sosmith.Chain:
    return sosmith.design_chain(TREES[name])


@cache
def summary(name: str) -> dict[str, Any]:
    core = designed(name).core
    traces = traces_of(core.stages[0].design, "noise", seed=1, seconds=0.02)
    return chain_summary(core, run_of(core, side_by_side([each.codes for each in traces])), traces)


@pytest.mark.slow
def test_chains_stand_beside_each_other(tmp_path: Path) -> None:
    """With the bound by stage, the filter from end to end, clocks and cost; from a file as from memory."""
    for name in ("plain", "up"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "report.json").write_text(json.dumps(summary(name)), encoding="utf-8")
    comparison = sosmith.compare([tmp_path / "plain", tmp_path / "up"])
    rows = {row.key: row for row in comparison.rows}
    plain, up = designed("plain"), designed("up")
    assert comparison.names == ["plain", "up"]
    assert rows["error.bound"].values == (float(plain.bound), float(up.bound))
    for k, chain in enumerate((plain, up)):
        for stage, part in chain.budget.items():
            key = f"error.parts.{stage}"
            assert (key in rows) == (part > 0)  # stages that add nothing have no row
            if part > 0:
                assert rows[key].values[k] == float(part)
                assert rows[key].title == f"of it, {stage}"
    assert rows["aliases.anywhere_db"].values[0] == pytest.approx(20 * np.log10(plain.folding["anywhere"][0]))
    assert rows["aliases.anywhere_db"].values[1] == pytest.approx(20 * np.log10(up.images["anywhere"][0]))
    faces = [chain_interface(chain.core) for chain in (plain, up)]
    assert rows["latency_cycles"].values == tuple(face.latency_cycles for face in faces)
    luts = [sum(hardware_cost(one.core)["luts"] for one in chain.stages) for chain in (plain, up)]
    assert rows["provenance.cost.luts"].values == tuple(luts)
    assert {row.best for row in comparison.rows} == {()}  # they do different jobs
    titles = [one.title for one in comparison.differences if one.title.startswith("stage.fill.")]
    assert titles == ["stage.fill.kind", "stage.fill.interpolate", "stage.fill.taps"]
    counted = next(stage for stage, part in up.budget.items() if part > 0)
    assert f"| of it, {counted} |" in comparison.markdown()


def test_a_chain_of_one_filter_does_the_same_job_as_the_filter_alone() -> None:
    core = sosmith.design(FILTER).core
    alone = designed("alone").core
    traces = traces_of(core, "noise", seed=1, seconds=0.02)
    chain, single = chain_provenance(alone, traces), provenance_of(core, traces)
    for name in ("reference_sha256", "trace_sha256", "datapath_sha256", "cycles_per_sample", "cost"):
        assert getattr(chain, name) == getattr(single, name), name


def test_a_calibration_and_a_filter_are_an_instrument() -> None:
    tree = instrument()
    calibration, filter_ = tree.pop("stage")
    stages = [calibration, {"name": "low", "kind": "fir", "taps": filter_["taps"]}]
    chain = sosmith.design_chain(tree | {"stage": stages}).core
    parts = {"calibration": {"coefficients": calibration["coefficients"]}, "filter": {"taps": filter_["taps"]}}
    core = sosmith.design(tree | parts).core
    traces = traces_of(core, {"voltage": [1.0, 2.0], "temperature": [20.0, 20.0]}, seed=1, seconds=None)
    assert chain_provenance(chain, traces).reference_sha256 == provenance_of(core, traces).reference_sha256


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "filter_"),
    [
        ("iir", {"family": "butterworth", "order": 2, "cutoff": 200.0}),
        ("fir", {"family": "equiripple", "passband_edge": 400.0, "stopband_edge": 900.0, **LOSSES}),
    ],
)
def test_aliases_of_a_filter_alone_are_those_of_a_chain_of_it(kind: str, filter_: dict[str, Any]) -> None:
    """Proven by one, measured or proven by the other."""
    base = {key: value for key, value in PLAIN.items() if key != "stage"}
    core = sosmith.design({**base, "filter": {"kind": "lowpass", "decimate": 4, **filter_}}).core
    chain = sosmith.design_chain({**base, "stage": [{"name": "a", "kind": kind, "decimate": 4, **filter_}]}).core
    assert aliases_of_core(core_facts(core)) == pytest.approx(aliases_entry(chain), abs=0.02)


@pytest.mark.parametrize("name", ["alone", "plain"])
@pytest.mark.parametrize("change", [{"taps": [0.5, 0.5]}, {"decimate": 3}, {"decimate": None, "interpolate": 2}])
def test_another_filter_is_another_job(change: dict[str, Any], name: str) -> None:
    *before, last = TREES[name]["stage"]
    changed = {key: value for key, value in (last | change).items() if value is not None}
    chains = [designed(name).core, sosmith.design_chain({**PLAIN, "stage": [*before, changed]}).core]
    traces = traces_of(chains[0].stages[0].design, "noise", seed=1, seconds=0.02)
    one, other = (chain_provenance(chain, traces).reference_sha256 for chain in chains)
    assert one != other


def test_the_smaller_error_of_the_same_job_wins() -> None:
    """A chain with one bit more is better, and the baseline says so."""
    plain, finer = summary("plain"), summary("finer")
    rows = {row.key: row for row in sosmith.compare([plain, finer]).rows}
    assert rows["error.bound"].best == (1,)
    assert sosmith.compare([finer], baseline=plain, tolerance="error=0,bound=0").passed
    judged = sosmith.compare([plain], baseline=finer, tolerance="bound=5%")
    assert not judged.passed
    assert [one.verdict for one in judged.judgements[0].judged] == ["worse"]


@pytest.mark.parametrize("name", ["plain", "up"])
def test_the_delay_is_the_slope_of_the_phase(name: str) -> None:
    chain, step, rate = designed(name), 1e-3, 8000.0
    gains = chain.frequency_response([0.0, step])
    entry = delay_entry(chain.core)
    assert entry is not None
    assert entry["seconds"] == pytest.approx(-np.angle(gains[1] / gains[0]) / (2 * np.pi * step), rel=1e-6)
    assert entry["seconds"] * rate > 1


def test_losses_of_a_chain_are_those_of_its_gain() -> None:
    mask = {"passband_edge": 200.0, "stopband_edge": 500.0, **LOSSES}
    stages = [{"name": "a", "kind": "cic", "order": 2, "decimate": 2}, {"name": "b", "kind": "fir", **mask}]
    chain = sosmith.design_chain({**PLAIN, "stage": stages})
    found = response_entry(chain.core)
    f = np.linspace(0, 4000, 4001)
    gain = 20 * np.log10(np.maximum(abs(chain.frequency_response(f)), 1e-10))
    inside = gain[f <= 200]
    assert found["passband_loss_db"] == pytest.approx(inside.max() - inside.min(), abs=1e-3)
    assert found["stopband_attenuation_db"] == pytest.approx(inside.max() - gain[f >= 500].max(), abs=0.05)
    assert response_entry(designed("plain").core) == dict.fromkeys(found)
