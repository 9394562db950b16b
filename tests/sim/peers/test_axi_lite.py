"""The reload port against an AXI4-Lite manager that others wrote, in a simulator."""

import contextlib
from pathlib import Path

import pytest
from cocotb_tools.check_results import get_results
from cocotb_tools.runner import Icarus
from tests.sim.lint import icarus_check, lint
from tests.suite.extras import needs

from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.hdl.reload import ReloadPort
from sosmith.sim.simulators import PLAIN_ASSERTIONS

pytestmark = needs("cocotbext.axi")

ROOT = Path(__file__).parents[3]


@pytest.fixture(autouse=True)
def peer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the simulator's Python find the peer: cocotb hands it our path."""
    monkeypatch.syspath_prepend(str(ROOT))


def results(tmp_path: Path, verilog: str) -> tuple[int, int]:
    """Run the peer; return how many tests ran and how many failed."""
    source, found = tmp_path / "port.sv", tmp_path / "results.xml"
    source.write_text(verilog, encoding="utf-8")
    runner = Icarus()
    runner.build(sources=[source], hdl_toplevel="port", build_dir=tmp_path, timescale=("1ns", "1ps"))
    with contextlib.suppress(SystemExit):  # what the runner makes of a failed test
        runner.test(
            test_module="tests.sim.peers.axi_lite_peer",
            hdl_toplevel="port",
            hdl_toplevel_lang="verilog",
            build_dir=tmp_path,
            test_dir=tmp_path,
            results_xml=str(found),
            seed=1,
            timescale=("1ns", "1ps"),
            extra_env=PLAIN_ASSERTIONS,
        )
    return get_results(found)


def port() -> str:
    return to_verilog(to_rtlil(ReloadPort(6, design=0x0BADCAFE), "port"))


@pytest.mark.slow
def test_a_manager_of_others_loads_sets(tmp_path: Path) -> None:
    assert results(tmp_path, port()) == (1, 0)


def test_the_manager_notices_a_broken_port(tmp_path: Path) -> None:
    sound = port()
    assert sound.count("32'd3988292384") == 1  # the CRC's polynomial
    assert results(tmp_path, sound.replace("32'd3988292384", "32'd3988292385")) == (1, 1)


def test_the_port_is_taken_without_a_warning(tmp_path: Path) -> None:
    source = tmp_path / "port.sv"
    source.write_text(port(), encoding="utf-8")
    assert lint(source, "port", tmp_path) == []
    assert icarus_check(source, "port") == []
