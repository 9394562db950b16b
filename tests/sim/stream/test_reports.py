"""Whole reports of one run in every bench: equal but for speed, simulator and tools."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from tests.gen.designs import EXAMPLES

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.report.page import render_page
from sosmith.gen.report.report import summarise
from sosmith.gen.specification.specification import from_text, load
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.model.text_files import to_json
from sosmith.sim import simulation
from sosmith.sim.simulation import simulate
from sosmith.sim.simulator_bench import SimulatorBench

SPEED = {"cycles_per_second", "wall_seconds"}
BENCHES = {
    "Verilator": {"simulator": "verilator"},
    "loop in Python": {"simulator": "verilator", "compiled": False},
    "waves": {"simulator": "verilator", "waves": True},
    "CXXRTL": {"simulator": "cxxrtl"},
    "CXXRTL, waves": {"simulator": "cxxrtl", "waves": True},
    "Icarus": {"simulator": "icarus"},
}
Report = Callable[..., dict[str, Any]]


def made_in(architecture: str, channels: int) -> CoreDesign:
    spec = load(EXAMPLES / "flange_wear_bench.toml")
    hardware = replace(spec.hardware, architecture=architecture, realization="df1_ef1")
    return design_core(replace(spec, hardware=hardware, channels=channels))


@pytest.fixture
def report_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Report:
    """Return a function that runs some samples, and gives report.json without speeds."""

    def report(made: CoreDesign, samples: int, *, compiled: bool = True, **options: Any) -> dict[str, Any]:
        monkeypatch.setattr(simulation, "SimulatorBench", partial(SimulatorBench, compiled=compiled))
        traces = [
            replace(trace, codes=trace.codes[:samples], truth=None, reading=None)
            for trace in traces_for(made, "bench_43_50", seed=8)
        ]
        found = summarise(simulate(made, traces, tmp_path, seed=8, **options))
        assert to_json(found)
        assert found.keys() > SPEED
        found["facts"] = [group for group in found["facts"] if group["title"] != "The simulation"]  # its speed
        return {key: value for key, value in found.items() if key not in SPEED}

    return report


def check_all(report_of: Report, made: CoreDesign, samples: int, benches: set[str]) -> None:
    first = report_of(made, samples, **BENCHES["Verilator"])
    assert first["passed"]
    for name in sorted(benches):
        other = report_of(made, samples, **BENCHES[name])
        if BENCHES[name]["simulator"] == "verilator":
            assert other == first, name
        else:
            assert other["simulator"] == BENCHES[name]["simulator"] in other["tools"]
            assert other | {key: first[key] for key in ("simulator", "tools")} == first, name


@pytest.mark.slow
def test_reports_are_equal(report_of: Report) -> None:
    check_all(report_of, made_in("folded", 2), 100, {"loop in Python", "CXXRTL"})


@pytest.mark.slow
@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("architecture", ["parallel", "folded", "serial"])
def test_reports_of_every_bench_are_equal(architecture: str, channels: int, report_of: Report) -> None:
    check_all(report_of, made_in(architecture, channels), 300, {*BENCHES})


PURE_DELAY = """
name = "pure_delay"
sample_rate = 1000.0
[input.x]
bits = 8
range = [0.0, 10.0]
[filter]
sos = [[0, 1, 0, 1, 0, 0]]
[output]
bits = 8
range = [0.0, 10.0]
unit = "V"
max_error = "faithful"
[hardware]
architecture = "parallel"
realization = "df1"
"""


@pytest.mark.slow
def test_hardware_that_rounds_nothing(tmp_path: Path) -> None:
    """A report of a bound of 0 is written like any other."""
    made = design_core(from_text(PURE_DELAY, tmp_path / "pure_delay.toml"))
    traces = [replace(trace, codes=trace.codes[:100]) for trace in traces_for(made, "noise", seed=8)]
    traces = [replace(trace, truth=None, reading=None) for trace in traces]
    evidence = simulate(made, traces, tmp_path)
    found = summarise(evidence)
    assert (found["error"]["max_abs"], found["error"]["bound"], found["passed"]) == (0, 0, True)
    assert "the proven limit is 0" in render_page(evidence, found)
