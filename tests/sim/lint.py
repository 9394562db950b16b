"""Checks generated SystemVerilog with Verilator's linter and with Icarus, and returns their warnings."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Collection
from pathlib import Path

from sosmith.gen.output.packages.lint_waivers import WAIVERS
from sosmith.model.errors import ShortfallError
from sosmith.sim.simulators import find_simulator


def lint(sv: Path, top: str, build_dir: Path, *, waived: Collection[str] = tuple(WAIVERS)) -> list[str]:
    """Check `sv` with Verilator's ``--lint-only -Wall``.

    Parameters
    ----------
    sv : Path
        The SystemVerilog file.
    top : str
        Its top module.
    build_dir : Path
        Folder that Verilator may write into, made if missing.
    waived : collection of str
        Names of the warnings to leave out.

    Returns
    -------
    list of str
        The other warnings, one line each.

    Raises
    ------
    ShortfallError
        If Verilator rejects the file; gives the reason.
    ToolError
        If Verilator is missing.
    """
    verilator = find_simulator("verilator", build_dir / "bin")
    # With -Wno-fatal, the exit status is nonzero only for errors.
    options = ["--lint-only", "-Wall", "-Wno-fatal", *(f"-Wno-{name}" for name in sorted(waived))]
    result = subprocess.run(
        ["verilator", *options, "--top-module", top, str(sv.resolve())],
        capture_output=True,
        text=True,
        check=False,
        cwd=build_dir,
        env=verilator.environment,
    )
    if result.returncode:
        raise ShortfallError(f"{sv} must be taken by Verilator, not refused: {_first_error(result.stderr, '%Error')}")
    return re.findall(r"^%Warning-.*", result.stderr, flags=re.MULTILINE)


def icarus_check(sv: Path, top: str) -> list[str]:
    """Parse and elaborate `sv` with Icarus (``-g2012 -Wall``).

    Returns
    -------
    list of str
        Its warnings, one line each.

    Raises
    ------
    ShortfallError
        If Icarus rejects the file; gives the reason.
    ToolError
        If Icarus is missing.
    """
    icarus = find_simulator("icarus", sv.parent)
    result = subprocess.run(
        ["iverilog", "-g2012", "-Wall", "-t", "null", "-s", top, str(sv)],
        capture_output=True,
        text=True,
        check=False,
        env=icarus.environment,
    )
    if result.returncode:
        raise ShortfallError(f"{sv} must be taken by Icarus, not refused: {_first_error(result.stderr, 'error')}")
    return result.stderr.splitlines()


def _first_error(text: str, mark: str) -> str:
    """First line that contains `mark`, or else the first line."""
    lines = text.splitlines() or ["no message"]
    return next((line for line in lines if mark in line), lines[0]).strip()
