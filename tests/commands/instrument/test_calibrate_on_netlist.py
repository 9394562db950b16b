"""`sosmith calibrate reference --port` on the netlist of a board with converters, over a pseudo-terminal."""

import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from tests.instrument.calibration.measuring import readings, write_csv
from tests.interface.instrument.live.gauging import GAUGE

import sosmith
from sosmith.cli import cli
from sosmith.sim.converters.values import fed_codes
from sosmith.sim.virtual_board.netlist import build
from sosmith.sim.virtual_board.terminal import Terminal

SPEC = GAUGE | {
    "converter": {
        "voltage": {"device": "mcp3202", "range": [0.0, 10.0]},
        "temperature": {"device": "max31855"},
    },
    "hardware": GAUGE["hardware"] | {"clock": 4e6},
}
TARGETS = {2.2: (2.0, 25.0), 4.6: (5.0, 25.0)}
"""Clearance in mm: what the sensor gives there in V, and its temperature in degC."""

SOME = 16
"""Samples of what the converters measure; the last one stays."""


def call(*arguments: str, typed: str | None = None) -> Result:
    return CliRunner(env={"COLUMNS": "100"}).invoke(cli, ["calibrate", *arguments], input=typed)


@pytest.mark.slow
def test_targets_are_read_from_the_netlist(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The voltage that is stored is that of the converter's code, to what the core's proven bound says."""
    monkeypatch.chdir(tmp_path)
    write_csv(Path("a.csv"), readings(60))
    assert call("add", "a.csv", "--date", "2024-03-01").exit_code == 0
    design = sosmith.design(SPEC)
    design.generate(tmp_path / "build" / "targets")
    netlist = build(design.core, tmp_path / "board", clock=Fraction(4_000_000))
    assert netlist.schedule is not None
    inputs = design.core.datapath.inputs
    for target, values in TARGETS.items():
        one = [int(port.encode(np.array([value]))[0]) for port, value in zip(inputs, values, strict=True)]
        codes = np.tile(np.array(one, dtype=np.int64), (SOME, 1, 1))
        measured = inputs[0].decode(fed_codes(netlist.schedule, codes)[-1, 0, 0])
        with Terminal() as terminal, netlist.at(terminal.end, wait=10_000, codes=codes):
            result = call(
                "reference",
                "--port",
                terminal.path,
                "--target",
                f"{target:g}mm",
                "--temperature",
                f"{values[1]:g}",
                "--seconds",
                "0.1",
                "--date",
                "2024-03-02",
                "--json",
                typed="\n",
            )
        assert (result.exit_code, result.exception) == (0, None)
        (live,) = json.loads(result.stdout)["live"]
        assert (live["clearance_mm"], live["results"], live["scatter_V"]) == (target, 100, 0.0)
        assert live["voltage_V"] == pytest.approx(float(measured), abs=0.002)
    stored = [row.split(",") for row in call("export", "--format", "csv").stdout.splitlines()[-len(TARGETS) :]]
    assert [float(row[0]) for row in stored] == list(TARGETS)
    assert [float(row[1]) for row in stored] == pytest.approx([volts for volts, _ in TARGETS.values()], abs=0.005)
