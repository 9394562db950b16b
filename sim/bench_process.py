"""The bench's own process: builds the simulation and runs the bench in it, with cocotb's runner or in CXXRTL.

Each simulator loads what it needs itself, since loading takes longer than a short run.

``python -m sosmith.sim.bench_process FOLDER`` reads ``FOLDER/job.json``. All output of simulators, compilers and cocotb
goes to this process's output, which the parent keeps in a log file.
"""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

from sosmith.model.errors import ToolError

_LOOK_SECONDS = 0.5
"""How often it looks whether its parent is still there."""


def main() -> None:
    """Build if anything changed since the last build, then run."""
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    job = json.loads((Path(sys.argv[1]) / "job.json").read_text(encoding="utf-8"))
    try:
        _RUNS[job["simulator"]](job)
    except (RuntimeError, subprocess.CalledProcessError):
        # A command failed: the log should end with its output, not with our traceback.
        sys.exit(1)
    except ToolError as error:
        sys.exit(str(error))


def _end_with(parent: int) -> None:
    """End this process, and all that it has started, once its parent is gone: killed, it could not do so itself."""
    while os.getppid() == parent:
        time.sleep(_LOOK_SECONDS)
    os.killpg(0, signal.SIGKILL)  # the bench has a session of its own


def _run_verilator(job: dict[str, Any]) -> None:
    from cocotb_tools.runner import Verilator

    from sosmith.sim.verilated_model import Builder, Model

    build = _build_folder(job)
    model = Model(
        source=Path(job["source"]),
        top=job["top"],
        ports=tuple(job["ports"]),
        signals=tuple(job["signals"]),
        waves=job["waves"],
    )
    Builder(job["version"], os.environ, build).build(model, build / job["top"])
    _test(job, Verilator(), ["+verilator+rand+reset+2", f"+verilator+seed+{job['seed'] % 2**31 or 1}"])


def _run_cxxrtl(job: dict[str, Any]) -> None:
    from sosmith.sim.cxxrtl_model import build_cxxrtl
    from sosmith.sim.stream.bench import run_in
    from sosmith.sim.stream.cxxrtl_pins import CxxrtlPins, finished

    folder, build = Path(job["folder"]), _build_folder(job)
    library = build / "model.so"
    build_cxxrtl(Path(job["source"]), job["top"], job["signals"], os.environ, build, library, waves=job["waves"])
    finished(run_in(folder, CxxrtlPins(library, build / "dump.vcd" if job["waves"] else None)))


def _run_icarus(job: dict[str, Any]) -> None:
    from cocotb_tools.runner import Icarus

    runner = Icarus()
    _build_with_icarus(job, runner)
    _test(job, runner, [])


_RUNS = {"verilator": _run_verilator, "icarus": _run_icarus, "cxxrtl": _run_cxxrtl}


def _build_folder(job: dict[str, Any]) -> Path:
    build = Path(job["folder"]) / "build"
    build.mkdir(exist_ok=True)
    return build


def _build_with_icarus(job: dict[str, Any], runner: Any) -> None:
    build = Path(job["folder"]) / "build"
    record = build / "built.txt"
    fingerprint = _fingerprint(job)
    if record.exists() and record.read_text(encoding="utf-8") == fingerprint:
        return
    record.unlink(missing_ok=True)  # an interrupted build must not pass for the previous one
    runner.build(
        sources=[Path(job["source"])],
        hdl_toplevel=job["top"],
        build_dir=build,
        timescale=("1ns", "1ps"),
        waves=job["waves"],
        always=True,
    )
    record.write_text(fingerprint, encoding="utf-8")


def _fingerprint(job: dict[str, Any]) -> str:
    choices = [job["version"], job["waves"], sys.version, __file__]
    return hashlib.sha256(Path(job["source"]).read_bytes() + json.dumps(choices).encode()).hexdigest()


def _test(job: dict[str, Any], runner: Any, plusargs: list[str]) -> None:
    folder = Path(job["folder"])
    runner.test(
        test_module="sosmith.sim.stream.cocotb_pins",
        hdl_toplevel=job["top"],
        hdl_toplevel_lang="verilog",
        build_dir=folder / "build",
        test_dir=folder,
        results_xml=str(folder / "results.xml"),
        seed=job["seed"],
        timescale=("1ns", "1ps"),
        waves=job["waves"],
        plusargs=plusargs,
        extra_env={"SOSMITH_BENCH": str(folder)},
    )


if __name__ == "__main__":
    main()
