"""What tells one run from another: digests that change with their subject and with nothing else, costs, curves."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal
from tests.commands.command_line import FILTER
from tests.gen.report.evidences import evidence

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.estimate.estimate import USUAL, Estimate, usual_estimates
from sosmith.gen.fpga.boards import find_board
from sosmith.gen.fpga.synthesis import Netlist
from sosmith.gen.report import curves
from sosmith.gen.report.curves import STRETCHES, error_over_time, error_spectrum
from sosmith.gen.report.provenance import Provenance, hardware_cost, provenance_of
from sosmith.gen.report.report import summarise
from sosmith.gen.specification.specification import from_text
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.model.dataflow.program import Program

DIGESTS = ("specification_sha256", "reference_sha256", "trace_sha256", "datapath_sha256")


def made(text: str = FILTER, realization: str = "df1", seed: int = 1) -> tuple[CoreDesign, Provenance]:
    design = design_core(
        from_text(text + '[hardware]\narchitecture = "parallel"\n', Path("a.toml")), realization=realization
    )
    return design, provenance_of(design, traces_for(design, "noise", seed=seed, seconds=0.05))


@pytest.mark.parametrize(
    ("changes", "changed"),
    [
        ({}, set()),
        ({"text": FILTER + "# a comment\n"}, {"specification_sha256"}),
        ({"text": FILTER.replace('"plain"', '"other"')}, {"specification_sha256"}),
        ({"seed": 2}, {"trace_sha256"}),
        ({"realization": "df2t"}, {"datapath_sha256"}),
        (
            {"text": FILTER.replace("cutoff = 100.0", "cutoff = 110.0")},
            {"specification_sha256", "reference_sha256", "datapath_sha256"},
        ),
        ({"text": FILTER.replace("bits = 12", "bits = 11", 1)}, set(DIGESTS)),
    ],
)
def test_digests_change_with_their_subject(changes: dict[str, Any], changed: set[str]) -> None:
    (_, before), (_, after) = made(), made(**changes)
    assert {name for name in DIGESTS if getattr(before, name) != getattr(after, name)} == changed


def estimate_of(design: CoreDesign) -> Estimate:
    return usual_estimates(design.architecture, find_board(USUAL[0]))[0]


def test_cost_by_its_origin(tmp_path: Path) -> None:
    design, provenance = made()
    assert provenance.cost == hardware_cost(design)
    assert (provenance.cost["source"], provenance.cost["luts"]) == ("estimate", estimate_of(design).luts)
    cells = {"SB_LUT4": 952, "SB_MAC16": 13}
    netlist = Netlist(find_board("icebreaker"), tmp_path / "netlist.v", cells, "0.70")
    counted = hardware_cost(design, netlist)
    assert (counted["source"], counted["board"]) == ("synthesis", "icebreaker")
    assert (counted["luts"], counted["multiplier_blocks"], counted["register_bits"]) == (952, 13, None)
    folded = design_core(replace(design.spec, hardware=replace(design.spec.hardware, architecture="folded")))
    program = folded.architecture.program
    assert isinstance(program, Program)
    cost = hardware_cost(folded)
    found = estimate_of(folded)
    assert (cost["source"], cost["device"], cost["instructions"]) == (
        "estimate",
        found.device,
        len(program.instructions),
    )
    assert (cost["luts"], cost["register_bits"], cost["memory_bits"]) == (
        found.luts,
        found.flip_flops,
        found.memory_bits,
    )
    assert (cost["multiplier_blocks"], cost["within"]) == (1, found.tested.nine_in_ten)


def test_error_over_time_keeps_every_peak() -> None:
    run = evidence()
    error = run.run.hardware - run.run.golden
    curve = error_over_time(run.run.error, run.run.instants)
    assert [len(values) for values in curve.values()] == [STRETCHES] * 3
    assert (min(curve["low"]), max(curve["high"])) == pytest.approx((error.min(), error.max()), rel=1e-5)
    start = int(np.searchsorted(run.run.time, curve["time"][7]))
    stop = int(np.searchsorted(run.run.time, curve["time"][8]))
    assert curve["high"][7] == pytest.approx(error[start:stop].max(), rel=1e-5)


def test_spectrum_of_the_error_has_its_power() -> None:
    """The density of white noise, over the whole band, is its root mean square (Parseval)."""
    run = evidence()
    found = error_spectrum(run.shown.run.error, run.run.instants)
    assert found is not None
    step = found["frequency"][1] - found["frequency"][0]
    power = sum(density**2 for density in found["density"]) * step
    assert math.sqrt(power) == pytest.approx(summarise(run)["error"]["rms"], rel=0.05)
    assert found["frequency"][-1] == pytest.approx(50.0)


@pytest.mark.parametrize("samples", [33, 100, 3000])
def test_the_spectrum_is_scipys(samples: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(curves, "_SEGMENTS", 4)
    values = np.random.default_rng(samples).standard_normal(samples)
    for found, wanted in zip(
        curves._spectrum(values, 50.0), signal.welch(values, fs=50.0, nperseg=min(256, samples)), strict=True
    ):
        assert found == pytest.approx(wanted, rel=1e-9, abs=1e-15)


def test_report_tells_the_provenance() -> None:
    _, provenance = made()
    summary = summarise(evidence(provenance=provenance))
    assert summary["provenance"]["trace_sha256"] == provenance.trace_sha256
    assert summary["curves"]["filter"]["sample_rate"] == 100.0
    assert summarise(evidence())["provenance"] is None
