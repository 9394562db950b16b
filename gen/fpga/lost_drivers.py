"""Finds what synthesis has left without a driver: then the netlist computes something else than the design.

`abc9` of Yosys 0.70 does so around nets with two names of which one has to be kept, as all have with `hardware.keep`,
where products are made of LUT. Of a LUT, an input counts if its table depends on it.
"""

from __future__ import annotations

from typing import Any

from sosmith.model.errors import ToolError

_LUTS = {"SB_LUT4": ("LUT_INIT", ("I0", "I1", "I2", "I3")), "LUT4": ("INIT", ("A", "B", "C", "D"))}
"""Parameter with the table of a LUT, and its inputs, the lowest bit of the address first, by the cell's name."""


def check_drivers(netlist: dict[str, Any]) -> None:
    """Check that every input that a LUT depends on has a driver, in the top module of a netlist of `write_json`.

    Raises
    ------
    ToolError
        If one has not.
    """
    (top,) = (module for module in netlist["modules"].values() if "top" in module["attributes"])
    for name, cell in top["cells"].items():
        if cell["type"] not in _LUTS:
            continue
        parameter, inputs = _LUTS[cell["type"]]
        table = int(cell["parameters"][parameter].replace("x", "0"), 2)
        for place, port in enumerate(inputs):
            if cell["connections"].get(port) == ["x"] and _depends(table, place):
                raise ToolError(
                    f"every input of the netlist must have a driver, which {port} of {name} has lost in Yosys; "
                    "with hardware.keep = true, leave that out"
                )


def _depends(table: int, place: int) -> bool:
    """Whether a table of 16 bits depends on a bit of its address."""
    low = sum(1 << row for row in range(16) if not row >> place & 1)
    return (table >> (1 << place)) & low != table & low
