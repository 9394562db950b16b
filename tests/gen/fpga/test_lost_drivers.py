"""What synthesis leaves without a driver is refused, where it counts."""

from typing import Any

import pytest

from sosmith.gen.fpga.lost_drivers import check_drivers
from sosmith.model.errors import ToolError


def netlist(cell: str, parameter: str, table: str, **connections: Any) -> dict[str, Any]:
    cells = {"sum": {"type": cell, "parameters": {parameter: table}, "connections": connections}}
    return {"modules": {"other": {"attributes": {}, "cells": {}}, "top": {"attributes": {"top": "1"}, "cells": cells}}}


def test_a_lut_that_depends_on_what_has_no_driver_is_refused() -> None:
    """The table of ice40's cell is that of I1 and I2, the other one that of C alone."""
    both = netlist("SB_LUT4", "LUT_INIT", "0000000011000000", I0=["x"], I1=[3], I2=["x"], I3=["0"])
    sentence = (
        r"every input of the netlist must have a driver, which I2 of sum has lost in Yosys; "
        r"with hardware\.keep = true, leave that out"
    )
    with pytest.raises(ToolError, match=f"^{sentence}$"):
        check_drivers(both)
    alone = netlist("LUT4", "INIT", "1111000011110000", A=["x"], B=["x"], C=["x"], D=["x"])
    with pytest.raises(ToolError, match=r"^every input of the netlist must have a driver, which C of sum has lost "):
        check_drivers(alone)


@pytest.mark.parametrize("port", ["A", "B", "D"])
def test_what_does_not_count_needs_no_driver(port: str) -> None:
    connections = {"A": [1], "B": [2], "C": [3], "D": [4]} | {port: ["x"]}
    check_drivers(netlist("LUT4", "INIT", "1111000011110000", **connections))


def test_other_cells_are_not_looked_at() -> None:
    check_drivers(netlist("SB_MAC16", "MODE", "1", C=["x"]))
