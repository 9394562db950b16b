"""The bench's own process: builds the simulation and runs the bench in it, under cocotb or in CXXRTL.

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
from importlib.machinery import PathFinder
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from sosmith.model.errors import ToolError

_TESTS = "sosmith.sim.stream.cocotb_pins"
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
    from sosmith.sim.verilated_model import Builder, Model

    build = _build_folder(job)
    model = Model(
        source=Path(job["source"]),
        top=job["top"],
        ports=tuple(job["ports"]),
        signals=tuple(job["signals"]),
        waves=job["waves"],
    )
    program = build / job["top"]
    Builder(job["version"], os.environ, build).build(model, program)
    results = Path(job["folder"]) / "results.xml"
    results.unlink(missing_ok=True)
    random = ["+verilator+rand+reset+2", f"+verilator+seed+{job['seed'] % 2**31 or 1}"]
    subprocess.run(
        [str(program), *(["--trace"] if job["waves"] else []), *random],
        cwd=job["folder"],
        env=_cocotb_environment(job, results),
        check=True,
    )


def _cocotb_environment(job: dict[str, Any], results: Path) -> dict[str, str]:
    """Return what cocotb's runner sets for a program of Verilator, without the time that it takes to load.

    Raises
    ------
    ToolError
        If this Python has no shared library.
    """
    import cocotb_tools.config
    from find_libpython import find_libpython  # which cocotb requires

    python = find_libpython()
    if python is None:
        raise ToolError(f"Python must have a shared library for cocotb, not only the program {sys.executable}")
    package = find_spec("cocotb")
    assert package is not None
    simulator = PathFinder.find_spec("cocotb.simulator", package.submodule_search_locations)  # without loading cocotb
    assert simulator is not None
    return {
        **os.environ,
        "COCOTB_TEST_MODULES": _TESTS,
        "COCOTB_TOPLEVEL": job["top"],
        "COCOTB_RANDOM_SEED": str(job["seed"]),
        "COCOTB_RESULTS_FILE": str(results),
        "COCOTB_TRUST_INERTIAL_WRITES": "1",
        "GPI_USERS": f"{python};{Path(str(simulator.origin)).resolve()},initialize",
        "PATH": f"{os.environ['PATH']}{os.pathsep}{cocotb_tools.config.libs_dir}",
        "PYGPI_PYTHON_BIN": sys.executable,
        "PYTHONPATH": os.pathsep.join(sys.path),
        "SOSMITH_BENCH": job["folder"],
        "TOPLEVEL_LANG": "verilog",
    }


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

    runner, folder = Icarus(), Path(job["folder"])
    _build_with_icarus(job, runner)
    runner.test(
        test_module=_TESTS,
        hdl_toplevel=job["top"],
        hdl_toplevel_lang="verilog",
        build_dir=folder / "build",
        test_dir=folder,
        results_xml=str(folder / "results.xml"),
        seed=job["seed"],
        timescale=("1ns", "1ps"),
        waves=job["waves"],
        extra_env={"SOSMITH_BENCH": str(folder)},
    )


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


if __name__ == "__main__":
    main()
