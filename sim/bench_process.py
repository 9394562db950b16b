"""The bench's own process: builds the simulation with cocotb's runner and runs the bench in it.

``python -m sosmith.sim.bench_process FOLDER`` reads ``FOLDER/job.json``. All output of simulators, compilers and cocotb
goes to this process's output, which the parent keeps in a log file.
"""

from __future__ import annotations

import hashlib
import json
import sys
from pathlib import Path
from typing import Any

from cocotb_tools.runner import Icarus, Verilator, VerilatorControlFile


class _FastVerilator(Verilator):  # type: ignore[misc]
    """Cocotb's runner with only the ports public, which makes builds and simulations several times faster."""

    def _build_command(self) -> list[list[str]]:
        return [[word for word in command if word != "--public-flat-rw"] for command in super()._build_command()]


def main() -> None:
    """Build if anything changed since the last build, then run."""
    job = json.loads((Path(sys.argv[1]) / "job.json").read_text(encoding="utf-8"))
    folder = Path(job["folder"])
    if job["simulator"] == "verilator":
        runner: Any = _FastVerilator()
        control = folder / "ports.vlt"
        control.write_text(_control_file(job["top"], job["ports"]), encoding="utf-8")
        sources = [VerilatorControlFile(control), Path(job["source"])]
        # Registers without a reset start at random, as they do in hardware.
        arguments = ["-Wno-fatal", "-O3", "-CFLAGS", "-O2", "--x-initial", "unique"]
    else:
        runner = Icarus()
        sources, arguments = [Path(job["source"])], []
    try:
        _build_and_test(job, runner, sources, arguments)
    except RuntimeError:
        # A command failed: the log should end with its output, not with our traceback.
        sys.exit(1)


def _build_and_test(job: dict[str, Any], runner: Any, sources: list[Any], arguments: list[str]) -> None:
    folder = Path(job["folder"])
    build = folder / "build"
    record = build / "built.txt"
    if _changed(job, record, arguments):
        record.unlink(missing_ok=True)  # an interrupted build must not pass for the previous one
        runner.build(
            sources=sources,
            hdl_toplevel=job["top"],
            build_dir=build,
            build_args=arguments,
            timescale=("1ns", "1ps"),
            waves=job["waves"],
            always=True,
        )
        record.write_text(_fingerprint(job, arguments), encoding="utf-8")
    runner.test(
        test_module="sosmith.sim.stream_bench",
        hdl_toplevel=job["top"],
        hdl_toplevel_lang="verilog",
        build_dir=build,
        test_dir=folder,
        results_xml=str(folder / "results.xml"),
        seed=job["seed"],
        timescale=("1ns", "1ps"),
        waves=job["waves"],
        plusargs=["+verilator+rand+reset+2", f"+verilator+seed+{job['seed'] % 2**31 or 1}"]
        if job["simulator"] == "verilator"
        else [],
        extra_env={"SOSMITH_BENCH": str(folder)},
    )


def _control_file(top: str, ports: list[str]) -> str:
    lines = [f'public_flat_rw -module "{top}" -var "{port}"' for port in ports]
    return "`verilator_config\n" + "\n".join(lines) + "\n"


def _changed(job: dict[str, Any], record: Path, arguments: list[str]) -> bool:
    return not record.exists() or record.read_text(encoding="utf-8") != _fingerprint(job, arguments)


def _fingerprint(job: dict[str, Any], arguments: list[str]) -> str:
    source = Path(job["source"]).read_bytes()
    choices = [job["simulator"], job["version"], job["waves"], job["ports"], sys.version, arguments, __file__]
    return hashlib.sha256(source + json.dumps(choices).encode()).hexdigest()


if __name__ == "__main__":
    main()
