"""Makes one Verilog file of a netlist and the models of the cells in it, for a simulator to take in a core's place.

Flip-flops start at random there, so that results show that the reset reaches all that matters; memories start with the
content that the bitstream gives them.
"""

from __future__ import annotations

import re
from pathlib import Path

from sosmith.gen.boards import Device
from sosmith.gen.synthesis import Netlist, share_folder
from sosmith.model.errors import ToolError
from sosmith.model.text_files import write_files

_OF_YOSYS = {"ice40": ("ice40/cells_sim.v",), "ecp5": ("ecp5/common_sim.vh", "ecp5/ccu2c_sim.vh")}
"""Models that come with Yosys, by family."""

_OURS = {"ice40": (), "ecp5": (Path(__file__).parent / "ecp5_cells.v",)}
"""Models to take in their place, and those that Yosys has not."""

# The models of iCE40 flip-flops leave their initial value to a macro, and default values of inputs, which not every
# simulator knows, to three others.
_MACROS = """`define SB_DFF_INIT initial Q = 1'($urandom);
`define ICE40_DEFAULT_ASSIGNMENT_V(v)
`define ICE40_DEFAULT_ASSIGNMENT_0
`define ICE40_DEFAULT_ASSIGNMENT_1
"""

_MODULE = re.compile(r"^module\s+(\w+)\b.*?\bendmodule\b", re.MULTILINE | re.DOTALL)


def with_cell_models(netlist: Netlist, device: Device) -> Path:
    """Write ``gates.v`` beside the netlist: the netlist, and a model of each cell that it needs.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ToolError
        If there is no model of a cell, or Yosys is missing.
    """
    files = [*(share_folder() / name for name in _OF_YOSYS[device.family]), *_OURS[device.family]]
    models = {found[1]: found[0] for file in files for found in _MODULE.finditer(file.read_text(encoding="utf-8"))}
    needed: list[str] = []
    wanted = sorted(netlist.cells)
    while wanted:
        cell = wanted.pop(0)
        if cell not in models:
            raise ToolError(f"every cell of {device.title} in a netlist must have a model, which {cell} has not")
        if cell not in needed:
            needed.append(cell)
            wanted += sorted({word for word in re.findall(r"\w+", models[cell]) if word in models} - {cell})
    texts = [_MACROS, *(models[cell] for cell in needed), netlist.path.read_text(encoding="utf-8")]
    return write_files(netlist.path.parent, {"gates.v": "\n".join(texts)})[0]
