"""Writes a design for a board as a project of a vendor's tools, and `build.json`, which says that none was run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from sosmith.gen.fpga.boards import RATE, Board
from sosmith.gen.fpga.vendor_project import TOOL, Project, project
from sosmith.gen.output.board_build import build_facts, texts
from sosmith.gen.output.board_top import Design, top_name, wiring_of
from sosmith.model.text_files import to_json, write_contents


@dataclass(frozen=True)
class BoardProject:
    """A design as a project for a board.

    Attributes
    ----------
    design : CoreDesign or BoardItem
        The design.
    rate : int
        Line rate in baud.
    core_verilog : str
        The core alone, whose digest the board tells.
    project : Project
        The files.
    """

    design: Design
    rate: int
    core_verilog: str
    project: Project

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The facts about it as a tree of JSON values: the content of ``build.json``."""
        return build_facts(self.design, self.project.board, self.rate, self.core_verilog) | {
            "passed": None,
            "bitstream": None,
            "project": {"tool": TOOL, "files": sorted(self.project.files), "command": self.project.command},
        }

    def write(self, folder: Path) -> list[Path]:
        """Write the files and ``build.json``.

        Raises
        ------
        SpecificationError
            If the folder cannot be written.
        ToolError
            If the disk is full.
        """
        contents = {name: text.encode() for name, text in self.project.files.items()}
        return write_contents(folder, contents | {"build.json": to_json(self.summary).encode()})


def board_project(
    design: Design, board: Board, *, rate: int = RATE, progress: Callable[[str], None] = lambda step: None
) -> BoardProject:
    """Make the project of a design for a board; parameters and errors as for `build_board`, but nothing is built."""
    core, verilog = texts(design, board, rate, progress)
    progress("project files")
    vendor_project = project(verilog, top_name(design), board, wiring=wiring_of(design, board))
    return BoardProject(design, rate, core, vendor_project)
