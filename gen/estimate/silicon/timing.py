"""The slowest path between registers of a mapped netlist, by OpenSTA; wires take no time.

Debian's package is of 2019. It reads the Verilog of netlists only, and ends with status 0 whatever it has read.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from fractions import Fraction
from pathlib import Path

from sosmith.model.errors import ToolError

PACKAGE = "opensta"
"""Debian package."""

_PROGRAM = "sta"
_ASKED = 1000
"""Period in ns that the paths are held against: longer than any."""

_SCRIPT = f"""read_liberty {{liberty}}
read_verilog {{netlist}}
link_design {{top}}
create_clock -name clock -period {_ASKED} [get_ports {{clock}}]
report_checks -path_delay max -from [all_registers -clock_pins] -to [all_registers -data_pins] -digits 4
exit
"""
_SLACK = re.compile(r"^\s*(-?\d+\.\d+)\s+slack \((?:MET|VIOLATED)\)$", re.MULTILINE)
_FAULT = re.compile(r"^(?:Error|Warning): .*$", re.MULTILINE)


def period_of(folder: Path, *, liberty: str, netlist: str, top: str, clock: str) -> Fraction | None:
    """Return the shortest period in ns of the clock of a netlist; None if OpenSTA is not installed.

    Parameters
    ----------
    folder : Path
        Where the files are.
    liberty, netlist : str
        Their names.
    top, clock : str
        The module, and its clock's port. All registers take over at its rising edge.

    Raises
    ------
    ToolError
        If OpenSTA finds a fault in the files, or no path.
    """
    program = shutil.which(_PROGRAM)
    if program is None:
        return None
    script = _SCRIPT.format(liberty=liberty, netlist=netlist, top=top, clock=clock)
    (folder / "paths.tcl").write_text(script, encoding="utf-8")
    done = subprocess.run(
        [program, "-no_splash", "-exit", "paths.tcl"], cwd=folder, check=False, capture_output=True, text=True
    )
    return period_in(done.stdout + done.stderr)


def period_in(said: str) -> Fraction:
    """Return the shortest period that a report of the slowest path says.

    Raises
    ------
    ToolError
        If it tells of a fault or names no path.

    Examples
    --------
    >>> period_in("           994.6990   slack (MET)")
    Fraction(5301, 1000)
    """
    if fault := _FAULT.search(said):
        raise ToolError(f"OpenSTA must read the netlist without a remark, not: {fault[0]}")
    slacks = _SLACK.findall(said)
    if len(slacks) != 1:
        raise ToolError(f"OpenSTA must report one path between registers, not {len(slacks)}")
    return _ASKED - Fraction(slacks[0])
