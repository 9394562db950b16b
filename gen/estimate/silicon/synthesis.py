"""Maps a core onto standard cells with Yosys and ABC: area, and the clock of the netlist before layout.

::

    SystemVerilog -- Yosys: flattened, memories as flip-flops --> gates and flip-flops
                  -- ABC: cells of the library, buffers where a cell drives many, sizes --> netlist
                  -- OpenSTA: slowest path between registers --> clock

Nothing is placed: wires take no area and no time, there is no clock tree, no scan chain and no pad. A layout takes more
of each.
"""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

from sosmith.gen.estimate.silicon.libraries import CellLibrary
from sosmith.gen.estimate.silicon.timing import period_of
from sosmith.gen.fpga.yosys import run_yosys, yosys_version
from sosmith.model.errors import ToolError
from sosmith.model.text_files import write_files

CLOCK = "aclk"
"""Port of the clock of every core."""

_SCOPE = "$scopeinfo"
"""What Yosys keeps of a module that it has dissolved: a name."""

# `splitnets`: OpenSTA takes no concatenations. `clean -purge`: nor names of nets that nothing reads.
_SCRIPT = """read_verilog -sv core.sv
synth -flatten -noabc -top {top}
dfflibmap -liberty cells.lib
abc -liberty cells.lib -constr ends.constr -D {period}
setundef -zero
clean -purge
splitnets -ports
clean -purge
tee -q -o area.json stat -liberty cells.lib -json
write_verilog -noattr -noexpr netlist.v
"""


@dataclass(frozen=True, kw_only=True)
class Silicon:
    """A core in standard cells, before layout.

    Attributes
    ----------
    library : CellLibrary
        The cells.
    area, of_registers : float
        Area of all cells, and of flip-flops among them, in um^2.
    cells : dict of str to int
        Count by the cell's name.
    period : Fraction or None
        Shortest period of the clock in ns; None without OpenSTA.
    version : str
        Version of Yosys.
    """

    library: CellLibrary
    area: float
    of_registers: float
    cells: dict[str, int]
    period: Fraction | None
    version: str

    @property
    def gates(self) -> int:
        """Area in NANDs of two inputs."""
        return round(self.area / self.library.nand2)

    @property
    def clock(self) -> float | None:
        """Highest clock in Hz; None without OpenSTA."""
        return None if self.period is None else float(10**9 / self.period)

    def as_dict(self) -> dict[str, Any]:
        """Return it in the types of JSON."""
        return {
            "library": self.library.name,
            "title": self.library.title,
            "corner": self.library.corner,
            "stage": "before layout",
            "area_um2": self.area,
            "area_of_registers_um2": self.of_registers,
            "nand2_equivalents": self.gates,
            "cells": self.cells,
            "clock_hz": self.clock,
            "yosys": self.version,
        }


def mapped(verilog: str, top: str, library: CellLibrary, wanted: Fraction) -> Silicon:
    """Map a core onto standard cells; takes some seconds, and a minute more on the very first call.

    Parameters
    ----------
    verilog : str
        Its SystemVerilog.
    top : str
        Its top module.
    library : CellLibrary
        The cells.
    wanted : Fraction
        Clock in Hz for which cells are sized.

    Raises
    ------
    ToolError
        If the library or Yosys is missing or fails, or OpenSTA does not read the netlist.
    """
    liberty = library.liberty
    ends = f"set_driving_cell {library.driver}\nset_load {library.load}\n"
    with tempfile.TemporaryDirectory(prefix="sosmith-") as scratch:
        folder = Path(scratch)
        write_files(folder, {"core.sv": verilog, "ends.constr": ends})
        (folder / "cells.lib").write_bytes(liberty)
        run_yosys(_SCRIPT.format(top=top, period=round(10**12 / wanted)), folder, "synthesis for silicon")
        found = json.loads((folder / "area.json").read_text(encoding="utf-8"))
        period = period_of(folder, liberty="cells.lib", netlist="netlist.v", top=top, clock=CLOCK)
    return silicon_of(found, library, period)


def silicon_of(found: dict[str, Any], library: CellLibrary, period: Fraction | None) -> Silicon:
    """Return what the statistics of Yosys and the slowest path say.

    Raises
    ------
    ToolError
        If Yosys has left a cell that the library does not have, or is missing.
    """
    design = found["design"]
    cells = {kind: count for kind, count in sorted(design["num_cells_by_type"].items()) if kind != _SCOPE}
    if others := [kind for kind in cells if kind.startswith("$")]:
        raise ToolError(f"every cell of a netlist must be one of {library.name}, not {', '.join(others)}")
    area, registers = float(design["area"]), float(design["sequential_area"])
    return Silicon(
        library=library, area=area, of_registers=registers, cells=cells, period=period, version=yosys_version()
    )
