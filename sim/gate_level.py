"""Combines a netlist and the models of its cells into one Verilog file that can be simulated in place of the core.

Memories start with the contents from the bitstream. Flip-flops start either with random values, which shows that the
reset is sufficient, or with those from the bitstream.
"""

from __future__ import annotations

import re
from pathlib import Path

from sosmith.gen.fpga.synthesis import Netlist
from sosmith.gen.fpga.yosys import share_folder
from sosmith.model.errors import ToolError
from sosmith.model.text_files import write_files

_OF_YOSYS = {
    "ice40": ("ice40/cells_sim.v",),
    "ecp5": ("ecp5/common_sim.vh", "ecp5/ccu2c_sim.vh"),
    "gatemate": ("gatemate/cells_sim.v",),
}
"""Models that come with Yosys, by family."""

_OURS = {
    "ice40": (),
    "ecp5": (Path(__file__).parent / "ecp5_cells.v",),
    "gatemate": (Path(__file__).parent / "gatemate_cells.v",),
}
"""Models that replace those of Yosys, or that Yosys lacks."""

# The models of iCE40 flip-flops take their initial value from a macro, and default values of inputs, which not every
# simulator supports, from three others. In hardware, the flip-flops start at 0.
_MACROS = """`define SB_DFF_INIT initial Q = `START(0);
`define ICE40_DEFAULT_ASSIGNMENT_V(v)
`define ICE40_DEFAULT_ASSIGNMENT_0
`define ICE40_DEFAULT_ASSIGNMENT_1
"""

_MODULE = re.compile(r"^module\s+(\w+)\b.*?\bendmodule\b", re.MULTILINE | re.DOTALL)
_PARAMETERS = re.compile(r"^  (\w+) #\((.*?)^  \) ", re.MULTILINE | re.DOTALL)


def with_cell_models(netlist: Netlist, *, scrambled: bool) -> Path:
    """Write ``gates.v`` beside the netlist, with the netlist and a model of each cell that it uses.

    Parameters
    ----------
    netlist : Netlist
        The netlist to simulate.
    scrambled : bool
        Whether flip-flops start with random values. Not usable if a memory has to keep its contents across a reset: a
        register before its write port could then write anything at the first clock edge.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ToolError
        If a cell has no model, the model lacks a parameter that the netlist sets, or Yosys is missing.
    """
    device = netlist.board.device
    files = [*(share_folder() / name for name in _OF_YOSYS[device.family]), *_OURS[device.family]]
    models = {match[1]: match[0] for file in files for match in _MODULE.finditer(file.read_text(encoding="utf-8"))}
    needed = sorted(netlist.cells)
    for cell in needed:  # grows while it is iterated: models instantiate further cells
        if cell not in models:
            raise ToolError(f"every cell of {device.title} in a netlist must have a model, which {cell} has not")
        needed += sorted(models.keys() & set(re.findall(r"\w+", models[cell])) - set(needed))
    text = netlist.path.read_text(encoding="utf-8")
    for cell, parameters in _PARAMETERS.findall(text):  # simulators may ignore one that the model lacks
        unknown = set(re.findall(r"\.(\w+)\(", parameters)) - set(re.findall(r"\w+", models[cell]))
        if unknown:
            raise ToolError(f"the model of {cell} must know what a netlist sets of the cell, as {min(unknown)}")
    start = "`define START(configured) " + ("1'($urandom)" if scrambled else "(configured)")
    texts = [start, _MACROS, *(models[cell] for cell in needed), text]
    return write_files(netlist.path.parent, {"gates.v": "\n".join(texts)})[0]
