"""Packages of small cores, each made once, and the tools that take them."""

import os
import re
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

from tests.interface.small import FILTER, INSTRUMENT

import sosmith
from sosmith.gen.output.packages.package import packed
from sosmith.sim.simulators import find_simulator

RELOADABLE: dict[str, Any] = {
    **FILTER,
    "name": "tunable",
    "input": {"x": {"bits": 12, "range": [0.0, 5.0]}},
    "output": {"bits": 12, "range": [0.0, 5.0], "unit": "V"},
    "hardware": {"realization": "df1_ef1", "architecture": "folded", "clock": 1e6, "reload": True, "protect": "detect"},
}
WIDE: dict[str, Any] = {
    **FILTER,
    "name": "wide",
    "filter": {**FILTER["filter"], "cutoff": 110.0},
    "hardware": {**FILTER["hardware"], "samples_per_clock": 8},
}
"""Eight samples in a beat of 128 bits; the samples of its bench fill no whole number of beats."""
SPARSE: dict[str, Any] = {
    **FILTER,
    "name": "sparse",
    "filter": {**FILTER["filter"], "cutoff": 20.0, "decimate": 4},
    "hardware": {"architecture": "folded", "clock": 12e6},
}
HELD: dict[str, Any] = {
    **SPARSE,
    "name": "held",
    "filter": {**SPARSE["filter"], "hold": True},
    "hardware": {**SPARSE["hardware"], "architecture": "parallel"},
}
SLOW_INSTRUMENT: dict[str, Any] = {
    **INSTRUMENT,
    "name": "slow_gauge",
    "channels": 1,
    "filter": {**INSTRUMENT["filter"], "cutoff": INSTRUMENT["sample_rate"] / 400, "decimate": 16},
    "hardware": {"architecture": "folded", "clock": 12e6},
}
"""A calibration of many clocks before a decimator: results are far apart."""
SPECIFICATIONS = {spec["name"]: spec for spec in (FILTER, INSTRUMENT, RELOADABLE, WIDE, SPARSE, HELD, SLOW_INSTRUMENT)}


@cache
def design_of(name: str) -> sosmith.Design:
    """Design the core `name`, once."""
    return sosmith.design(SPECIFICATIONS[name])


@cache
def package_of(name: str) -> dict[str, str]:
    """Return the package of the core `name`: its texts by their paths."""
    return packed(design_of(name).core)


def unpacked(name: str, folder: Path) -> Path:
    """Write the package of the core `name` into `folder`, and return that."""
    for path, text in package_of(name).items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    return folder


def called(*command: str | Path, at: Path, simulator: str = "icarus") -> subprocess.CompletedProcess[str]:
    """Run a command in the folder `at`, with a simulator where it finds it and without this package."""
    environment = find_simulator(simulator, at / ".bin").environment
    kept = {key: value for key, value in environment.items() if key not in {"PYTHONPATH", "PYTEST_CURRENT_TEST"}}
    for key in ("OBJCACHE", "CCACHE_DIR"):
        kept |= {key: os.environ[key]} if key in os.environ else {}
    return subprocess.run(command, cwd=at, env=kept, capture_output=True, text=True, check=False)


def spoil(path: Path, constant: str) -> int:
    """Add one unit to the first coefficient after `constant` in a file; return the number of coefficients found."""
    text = path.read_text(encoding="utf-8")
    found = list(re.finditer(constant, text))
    first = found[0]
    base = 16 if first[1] == "h" else 10
    changed = f"{int(first[2], base) + 1:{'x' if base == 16 else 'd'}}"
    path.write_text(text[: first.start(2)] + changed + text[first.end(2) :], encoding="utf-8")
    return len(found)
