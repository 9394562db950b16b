"""Standard cells: what is read of the programs' words, what is said without them, and a small library mapped."""

import re
import shutil
from fractions import Fraction
from pathlib import Path

import pytest
from tests.gen.estimate.silicon.small_library import liberty
from tests.interface.small import filter_design

from sosmith.gen.estimate.silicon import libraries, timing
from sosmith.gen.estimate.silicon.libraries import LIBRARIES, find_library
from sosmith.gen.estimate.silicon.synthesis import mapped, silicon_of
from sosmith.gen.estimate.silicon.timing import period_in
from sosmith.interface.build import silicon_table
from sosmith.model.errors import SpecificationError, ToolError

CELLS = LIBRARIES["osu018"]
STATISTICS = {
    "modules": {},
    "design": {
        "num_cells": 12,
        "area": 336.0,
        "sequential_area": 96.0,
        "num_cells_by_type": {"$scopeinfo": 2, "NAND2X1": 10, "DFFPOSX1": 1},
    },
}
REPORT = """Startpoint: _1_ (rising edge-triggered flip-flop clocked by clock)
             9.8158   data required time
            -5.1166   data arrival time
-------------------------------------------------------------
           994.7500   slack (MET)
"""
CORE = """module tiny(input aclk, aresetn, a, b, output reg [1:0] y);
  always_ff @(posedge aclk) y <= aresetn ? {y[0] ^ a, a & ~b} : 0;
endmodule
"""


def test_the_period_is_what_is_left_of_the_one_asked_for() -> None:
    assert period_in(REPORT) == Fraction(525, 100)


@pytest.mark.parametrize(
    ("said", "message"),
    [
        (
            "Error: netlist.v, line 3 syntax error, unexpected '{'.\n" + REPORT,
            "OpenSTA must read the netlist without a remark, not: Error: netlist.v, line 3 syntax error, unexpected "
            "'{'.",
        ),
        (
            "Warning: FOO not found. Creating black box for _1_.\n" + REPORT,
            "OpenSTA must read the netlist without a remark, not: Warning: FOO not found. Creating black box for _1_.",
        ),
        ("No paths found.\n", "OpenSTA must report one path between registers, not 0"),
        (REPORT + REPORT, "OpenSTA must report one path between registers, not 2"),
    ],
)
def test_no_period_is_told_of_a_report_with_a_fault(said: str, message: str) -> None:
    with pytest.raises(ToolError, match=f"^{re.escape(message)}$"):
        period_in(said)


def test_area_is_told_in_nands() -> None:
    found = silicon_of(STATISTICS, CELLS, Fraction(525, 100))
    assert found.cells == {"DFFPOSX1": 1, "NAND2X1": 10}
    assert found.gates == 14
    assert dict(silicon_table("core", found.as_dict()).rows) == {
        "cells": "OSU standard cells, TSMC 180 nm; typical, 1.8 V, 25 degC",
        "area": "0.0003 mm2, 29 % of it flip-flops",
        "gates": "14 NAND2 equivalents",
        "clock": "190.5 MHz",
        "not in it": "wires, clock tree, pads: this is before layout; memories are flip-flops",
    }


def test_a_cell_that_is_not_of_the_library_is_told() -> None:
    design = {**STATISTICS["design"], "num_cells_by_type": {"NAND2X1": 1, "$_DLATCH_P_": 2}}
    message = "every cell of a netlist must be one of osu018, not $_DLATCH_P_"
    with pytest.raises(ToolError, match=f"^{re.escape(message)}$"):
        silicon_of({"design": design}, CELLS, None)


def test_what_is_missing_is_named_with_its_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(libraries, "_PLACE", tmp_path)
    message = "the cells of osu018 are needed, and were not found: apt-get install qflow-tech-osu018"
    with pytest.raises(ToolError, match=f"^{re.escape(message)}$"):
        filter_design().silicon()
    message = "the standard cells must be one of osu018, osu035, not osu180 (did you mean osu018?)"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        find_library("osu180")


def test_a_core_is_mapped_onto_a_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place = tmp_path / "osu018" / "osu018_stdcells.lib"
    place.parent.mkdir()
    place.write_text(liberty(), encoding="utf-8")
    monkeypatch.setattr(libraries, "_PLACE", tmp_path)
    monkeypatch.setattr(timing, "_PROGRAM", "no such program")
    found = mapped(CORE, "tiny", CELLS, Fraction(10**8))
    areas = {"INVX4": 16, "NAND2X1": 24, "NOR2X1": 24, "XNOR2X1": 56, "BUFX2": 24, "DFFPOSX1": 96}
    assert found.cells.keys() <= areas.keys()
    assert found.cells["DFFPOSX1"] == 2
    assert found.area == sum(areas[kind] * count for kind, count in found.cells.items())
    assert found.of_registers == 192
    assert found.clock is None
    assert ("clock", "not known: apt-get install opensta") in silicon_table("tiny", found.as_dict()).rows


@pytest.mark.slow
@pytest.mark.parametrize("name", LIBRARIES)
def test_the_libraries_of_debian(name: str) -> None:
    library = LIBRARIES[name]
    try:
        text = library.liberty.decode()
    except ToolError:
        pytest.skip(f"{library.package} is not installed")
    nand = re.search(r"^cell \(NAND2X1\) \{\s*area : (\d+);", text, re.MULTILINE)
    assert nand is not None
    assert int(nand[1]) == library.nand2
    found = filter_design().silicon(name)
    assert found["nand2_equivalents"] > 500
    if shutil.which(timing._PROGRAM) is not None:
        assert 20e6 < found["clock_hz"] < 1e9
