"""Synthesizes a core's SystemVerilog for a board with Yosys, to a netlist of its FPGA's cells."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

from sosmith.gen.fpga.block_registers import cells_of, with_block_registers
from sosmith.gen.fpga.boards import Board
from sosmith.gen.fpga.lost_drivers import check_drivers
from sosmith.gen.fpga.yosys import run_yosys, yosys_version
from sosmith.model.text_files import to_json, write_files

_PACKING = "block registers 2"
"""Version of `sosmith.gen.fpga.block_registers`."""


@dataclass(frozen=True)
class Netlist:
    """A core mapped to the cells of an FPGA.

    Attributes
    ----------
    board : Board
        Target board.
    path : Path
        The netlist as Verilog, one flat module with the ports of the core.
    cells : dict of str to int
        Count by cell type.
    version : str
        Version of Yosys.
    """

    board: Board
    path: Path
    cells: dict[str, int]
    version: str

    @property
    def excess(self) -> list[str]:
        """Cells of which it needs more than the board has, such as ``"13 SB_MAC16 of 8"``."""
        return self.board.device.excess(self.cells)


def synthesize(sv: Path, top: str, board: Board, folder: Path) -> Netlist:
    """Synthesize the core in `sv` for `board`; takes seconds, and a minute more on the very first call.

    Files go to `folder`, created if missing. An existing netlist is reused if it was made from the same text by the
    same version of Yosys.

    Parameters
    ----------
    sv : Path
        The SystemVerilog file.
    top : str
        Its top module.
    board : Board
        Target board; the netlist may exceed its resources.
    folder : Path
        Folder for ``netlist.v``, ``netlist.json`` and ``synthesis.json``.

    Raises
    ------
    ToolError
        If Yosys is missing or fails, which shows its last lines, or loses a driver.
    """
    script = f"read_verilog -sv core.sv; {board.device.synthesis} -top {top}; write_json netlist.json"
    writing = "read_json netlist.json; write_verilog -noattr netlist.v"
    text = sv.read_bytes()
    version = yosys_version()
    fingerprint = hashlib.sha256(text + f"{script}{_PACKING}{version}".encode()).hexdigest()
    record, netlist = folder / "synthesis.json", folder / "netlist.v"
    if record.exists() and netlist.exists():
        earlier = json.loads(record.read_text(encoding="utf-8"))
        if earlier["fingerprint"] == fingerprint:
            return Netlist(board, netlist, earlier["cells"], version)
    record.unlink(missing_ok=True)  # leftovers of an interrupted run must not pass for a valid netlist
    write_files(folder, {"core.sv": text.decode()})
    run_yosys(script, folder)
    mapped = json.loads((folder / "netlist.json").read_text(encoding="utf-8"))
    check_drivers(mapped)
    packed = with_block_registers(mapped)
    write_files(folder, {"netlist.json": json.dumps(packed)})
    run_yosys(writing, folder)
    cells = {kind: count for kind, count in sorted(cells_of(packed).items()) if not kind.startswith("$")}
    write_files(folder, {"synthesis.json": to_json({"fingerprint": fingerprint, "cells": cells})})
    return Netlist(board, netlist, cells, version)
