"""Makes one Verilog file of a netlist and the models of its cells, for a simulator to take in a core's place.

Memories start with the content that the bitstream gives them. Flip-flops start at random, which shows that the reset
reaches all that matters, or as the bitstream says.
"""

from __future__ import annotations

import re
from pathlib import Path

from sosmith.gen.fpga.synthesis import Netlist, share_folder
from sosmith.model.errors import ToolError
from sosmith.model.text_files import write_files

_OF_YOSYS = {"ice40": ("ice40/cells_sim.v",), "ecp5": ("ecp5/common_sim.vh", "ecp5/ccu2c_sim.vh")}
"""Models that come with Yosys, by family."""

_OURS = {"ice40": (), "ecp5": (Path(__file__).parent / "ecp5_cells.v",)}
"""Models to take in their place, and those that Yosys has not."""

# The models of iCE40 flip-flops leave their initial value to a macro, and default values of inputs, which not every
# simulator knows, to three others. In hardware they start at 0.
_MACROS = """`define SB_DFF_INIT initial Q = `START(0);
`define ICE40_DEFAULT_ASSIGNMENT_V(v)
`define ICE40_DEFAULT_ASSIGNMENT_0
`define ICE40_DEFAULT_ASSIGNMENT_1
"""

_MODULE = re.compile(r"^module\s+(\w+)\b.*?\bendmodule\b", re.MULTILINE | re.DOTALL)
_PARAMETERS = re.compile(r"^  (\w+) #\((.*?)^  \) ", re.MULTILINE | re.DOTALL)


def with_cell_models(netlist: Netlist, *, scrambled: bool) -> Path:
    """Write ``gates.v`` beside the netlist: the netlist, and a model of each cell that it needs.

    Parameters
    ----------
    netlist : Netlist
        What to simulate.
    scrambled : bool
        Whether flip-flops start at random. A memory whose content must outlast a reset cannot bear that: a register
        before its write port may then write anything at the first clock edge.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ToolError
        If there is no model of a cell, or not of what a netlist sets of it, or if Yosys is missing.
    """
    device = netlist.board.device
    files = [*(share_folder() / name for name in _OF_YOSYS[device.family]), *_OURS[device.family]]
    models = {found[1]: found[0] for file in files for found in _MODULE.finditer(file.read_text(encoding="utf-8"))}
    needed = sorted(netlist.cells)
    for cell in needed:  # it grows by the cells that models are made of
        if cell not in models:
            raise ToolError(f"every cell of {device.title} in a netlist must have a model, which {cell} has not")
        needed += sorted(models.keys() & set(re.findall(r"\w+", models[cell])) - set(needed))
    text = netlist.path.read_text(encoding="utf-8")
    for cell, parameters in _PARAMETERS.findall(text):  # a simulator may pass over one that the model does not know
        unknown = set(re.findall(r"\.(\w+)\(", parameters)) - set(re.findall(r"\w+", models[cell]))
        if unknown:
            raise ToolError(f"the model of {cell} must know what a netlist sets of the cell, as {min(unknown)}")
    start = "`define START(configured) " + ("1'($urandom)" if scrambled else "(configured)")
    texts = [start, _MACROS, *(models[cell] for cell in needed), text]
    return write_files(netlist.path.parent, {"gates.v": "\n".join(texts)})[0]
