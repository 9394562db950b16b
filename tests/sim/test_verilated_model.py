"""What is read of the files that Verilator writes."""

from __future__ import annotations

from pathlib import Path

import pytest

from sosmith.sim import verilated_model

CLOCK = "__Vtrigprevexpr___TOP__aclk__0"


@pytest.mark.parametrize(
    ("members", "flags"),
    [
        (f"CData/*0:0*/ {CLOCK};\n    CData/*0:0*/ __VactContinue;", [f"-DBENCH_CLOCK_BEFORE={CLOCK}"]),
        ("CData/*0:0*/ __Vtrigprevexpr___TOP__sclk__0;", []),  # another clock
        (f"CData/*0:0*/ {CLOCK};\n    CData/*0:0*/ {CLOCK[:-1]}1;", []),  # which of the two, nobody knows
        ("VL_IN8(aclk,0,0);", []),  # as another version may have it
    ],
)
def test_the_member_that_remembers_the_clock_is_found(members: str, flags: list[str], tmp_path: Path) -> None:
    header = tmp_path / "Vtop___024root.h"
    header.write_text(f"class Vtop___024root {{\n  public:\n    {members}\n}};\n", encoding="utf-8")
    assert verilated_model._clock_before(header) == flags
