"""Runs a bench of converters in Icarus, and returns what it has found."""

from __future__ import annotations

import json
import re
from contextlib import suppress
from pathlib import Path
from typing import Any

from cocotb_tools.runner import Icarus

from sosmith.sim.simulators import PLAIN_ASSERTIONS

SCALE = ("1ns", "1ps")


def found_by(bench: str, folder: Path) -> dict[str, Any]:
    """Simulate ``front_end.sv`` of a folder with a bench, a module beside this, and return its ``found.json``.

    Raises
    ------
    AssertionError
        With the bench's own sentence, if it fails.
    """
    runner = Icarus()
    runner.build(
        sources=[folder / "front_end.sv"],
        hdl_toplevel="front_end",
        build_dir=folder / "build",
        timescale=SCALE,
        log_file=folder / "build.log",
    )
    with suppress(SystemExit):  # of a test that fails
        runner.test(
            test_module=f"tests.sim.converters.{bench}",
            hdl_toplevel="front_end",
            hdl_toplevel_lang="verilog",
            build_dir=folder / "build",
            test_dir=folder,
            results_xml=str(folder / "results.xml"),
            timescale=SCALE,
            extra_env={"CONVERTERS_BENCH": str(folder), **PLAIN_ASSERTIONS},
            log_file=folder / "run.log",
        )
    if not (folder / "found.json").exists():
        failed = re.findall(r"AssertionError: (.*)", (folder / "run.log").read_text())
        raise AssertionError(failed[0] if failed else (folder / "run.log").read_text())
    found: dict[str, Any] = json.loads((folder / "found.json").read_text())
    return found
