"""The bench's own process: what it hands to a program with cocotb inside."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from cocotb_tools.runner import Verilator

from sosmith.sim import bench_process


def job(folder: Path) -> dict[str, Any]:
    return {"top": "core", "seed": 7, "folder": str(folder), "waves": False}


def test_a_program_gets_what_cocotbs_runner_hands_to_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The next release of cocotb may want something else."""
    monkeypatch.delenv("PYTEST_CURRENT_TEST")  # with which the runner looks at the results itself
    runner, results = Verilator(), tmp_path / "results.xml"
    monkeypatch.setattr(runner, "_execute", lambda commands, cwd: None)
    runner.test(
        test_module="sosmith.sim.stream.cocotb_pins",
        hdl_toplevel="core",
        hdl_toplevel_lang="verilog",
        build_dir=tmp_path,
        results_xml=str(results),
        seed=7,
        extra_env={"SOSMITH_BENCH": str(tmp_path)},
    )
    expected = {key: value for key, value in runner.env.items() if key != "COCOTB_RESULTS_ATTACHMENTS"}
    assert bench_process._cocotb_environment(job(tmp_path), results) == expected


def test_python_must_have_a_shared_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("find_libpython.find_libpython", lambda: None)
    monkeypatch.setattr("sys.executable", "/usr/bin/python3")
    with pytest.raises(
        bench_process.ToolError,
        match=r"^Python must have a shared library for cocotb, not only the program /usr/bin/python3$",
    ):
        bench_process._cocotb_environment(job(tmp_path), tmp_path / "results.xml")
