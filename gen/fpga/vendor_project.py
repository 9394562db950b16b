"""Project files and constraints for a vendor's tools, for FPGAs that no open flow is run for.

What is written are the files of Amaranth's platform: its wrapper of the board's top in Verilog, the constraints, and
the script. No program is run but the Yosys that comes with Amaranth, which writes the wrapper.
"""

from __future__ import annotations

from dataclasses import dataclass

from sosmith.gen.fpga.boards import Board
from sosmith.gen.fpga.platform_plan import board_plan, text_of
from sosmith.gen.fpga.wiring import PLAIN, Wiring

TOOL = "Vivado"
"""The tools that projects are written for."""

_KINDS = (".v", ".xdc", ".tcl")


@dataclass(frozen=True)
class Project:
    """A design as a project for a vendor's tools.

    Attributes
    ----------
    board : Board
        The board.
    name : str
        Its name, and that of its top module.
    files : dict of str to str
        Verilog of the wrapper and of the board's top, constraints, and the script.
    """

    board: Board
    name: str
    files: dict[str, str]

    @property
    def command(self) -> str:
        """What makes a bitstream of it, in the folder of the files."""
        return f"vivado -mode batch -source {self.name}.tcl"


def project(verilog: str, top: str, board: Board, *, wiring: Wiring = PLAIN) -> Project:
    """Make a project; parameters as for `sosmith.gen.fpga.bitstream.build`.

    Raises
    ------
    ToolError
        If amaranth-boards is missing.
    SpecificationError
        If the board has too few pins for the converters.
    """
    name = f"{top}_{board.name}"
    plan = board_plan(verilog, top, name, board, wiring)
    wanted = [f"{top}.sv", *(f"{name}{kind}" for kind in _KINDS)]
    return Project(board, name, {file: text_of(plan, file) for file in wanted})
