"""Paths through multiplier blocks without registers, from delays as nextpnr-ice40 writes them."""

from typing import Any

import pytest

from sosmith.gen.fpga.block_paths import with_block_paths
from sosmith.model.errors import ToolError

REGISTERS = (
    "A_REG",
    "B_REG",
    "C_REG",
    "D_REG",
    "TOP_8x8_MULT_REG",
    "BOT_8x8_MULT_REG",
    "PIPELINE_16x16_MULT_REG1",
    "PIPELINE_16x16_MULT_REG2",
)


def delays(*wires: tuple[str, str, int]) -> str:
    """Return delays of two registers with a LUT, `one` and `two`, a block between them, and the wires."""
    told = "".join(f"(INTERCONNECT {start} {end} ({ps}:{ps}:{ps}) ({ps}:{ps}:{ps}))\n" for start, end, ps in wires)
    register = """
(CELL (CELLTYPE "ICESTORM_LC") (INSTANCE {name})
  (DELAY (ABSOLUTE (IOPATH CLK O (1390:1390:1390) (1390:1390:1390))))
  (TIMINGCHECK (SETUPHOLD (posedge I0) (posedge CLK) (1234:1234:1234) (0:0:0))))
"""
    outputs = "".join(f"(IOPATH CLK O_{bit} (100:100:100) (100:100:100))\n" for bit in range(32))
    block = f'(CELL (CELLTYPE "ICESTORM_DSP") (INSTANCE p_DSP) (DELAY (ABSOLUTE {outputs})))\n'
    top = f'(CELL (CELLTYPE "top") (INSTANCE ) (DELAY (ABSOLUTE\n{told})))\n'
    return top + register.format(name="one") + register.format(name="two") + block


def netlist(top: str = "11", bottom: str = "11", **registers: int) -> dict[str, Any]:
    """Return a netlist with a block: what its halves put out, and which registers it has."""
    parameters = {name: str(registers.get(name, 0)) for name in REGISTERS}
    parameters |= {"TOPOUTPUT_SELECT": top, "BOTOUTPUT_SELECT": bottom}
    return {
        "modules": {"t": {"attributes": {"top": "1"}, "cells": {"p": {"type": "SB_MAC16", "parameters": parameters}}}}
    }


def report(achieved: float = 200.0) -> dict[str, Any]:
    """Return what nextpnr says of the clocks: that of the registers, and that of a block which has none."""
    gnd = "$PACKER_GND_NET_$glb_clk"
    paths = [
        {"from": f"posedge {start}", "to": f"posedge {end}", "path": []}
        for start, end in (("clk", "clk"), ("clk", gnd))
    ]
    return {
        "fmax": {"clk": {"achieved": achieved, "constraint": 12.0}, gnd: {"achieved": 300.0, "constraint": 12.0}},
        "critical_paths": paths,
    }


CLOCKS = tuple((r"\$gbuf_clk/GLOBAL_BUFFER_OUTPUT", f"{cell}/CLK", 927) for cell in ("one", "two", "p_DSP"))


def slowest(sdf: str, placed: dict[str, Any], achieved: float = 200.0) -> float:
    """Return the ns of the clock; there is no other, and the path that is told takes as long."""
    found = with_block_paths(report(achieved), sdf, placed)
    assert found["fmax"].keys() == {"clk"}
    (path,) = found["critical_paths"]
    assert path["from"] == path["to"] == "posedge clk"
    time = 1e3 / found["fmax"]["clk"]["achieved"]
    assert not path["path"] or sum(step["delay"] for step in path["path"]) == pytest.approx(time)
    return time


@pytest.mark.parametrize(
    ("source", "end", "inside"),
    [
        ("A_3", "O_5", 7.4),
        ("B_3", "O_20", 8.9),
        ("D_3", "O_5", 3.4),
        ("D_3", "O_20", 4.0),
        ("C_3", "O_20", 3.0),
        ("A_6", "O_5", 7.4),  # two bits of a factor are recoded as one
    ],
)
def test_what_passes_through_a_block_takes_its_time_there_too(source: str, end: str, inside: float) -> None:
    sdf = delays(*CLOCKS, ("one/O", f"p_DSP/{source}", 2000), (f"p_DSP/{end}", "two/I0", 3000))
    assert slowest(sdf, netlist()) == pytest.approx(1.390 + 2 + inside + 3 + 1.234)


@pytest.mark.parametrize(("source", "end"), [("A_7", "O_5"), ("D_6", "O_5"), ("C_3", "O_15"), ("C_5", "O_20")])
def test_a_bit_reaches_none_below_its_own(source: str, end: str) -> None:
    sdf = delays(*CLOCKS, ("one/O", f"p_DSP/{source}", 2000), (f"p_DSP/{end}", "two/I0", 3000))
    assert slowest(sdf, netlist()) == pytest.approx(5.0)


def test_registers_at_the_factors_begin_a_path_in_the_block() -> None:
    sdf = delays(*CLOCKS, ("one/O", "p_DSP/A_3", 2000), ("p_DSP/O_20", "two/I0", 3000))
    assert slowest(sdf, netlist(A_REG=1)) == pytest.approx(8.9 + 3 + 1.234)


def test_registers_of_the_product_end_one_and_begin_another() -> None:
    before = delays(*CLOCKS, ("one/O", "p_DSP/A_3", 2000))
    assert slowest(before, netlist(TOP_8x8_MULT_REG=1)) == pytest.approx(1.390 + 2 + 8.9)
    behind = delays(*CLOCKS, ("p_DSP/O_20", "two/I0", 3000))
    assert slowest(behind, netlist(PIPELINE_16x16_MULT_REG1=1)) == pytest.approx(8.9 + 3 + 1.234)


def test_registers_at_the_output_end_a_path_in_the_block() -> None:
    sdf = delays(*CLOCKS, ("one/O", "p_DSP/D_3", 2000), ("p_DSP/O_20", "two/I0", 3000))
    assert slowest(sdf, netlist(top="01")) == pytest.approx(1.390 + 2 + 4.0)
    assert slowest(sdf, netlist(bottom="01")) == pytest.approx(1.390 + 2 + 4.0 + 3 + 1.234)


def test_two_blocks_after_one_another_take_the_time_of_both() -> None:
    sdf = delays(
        *CLOCKS,
        ("one/O", "p_DSP/A_3", 2000),
        ("p_DSP/O_5", "p_DSP/C_4", 1000),
        ("p_DSP/O_20", "two/I0", 3000),
    )
    assert slowest(sdf, netlist()) == pytest.approx(1.390 + 2 + 7.4 + 1 + 3.0 + 3 + 1.234)


def test_a_clock_of_another_name_counts_for_all() -> None:
    """The net behind a PLL has a name of its own, which the delays do not tell."""
    pll = [(r"\$gbuf_pll_pllout_a/GLOBAL_BUFFER_OUTPUT", sink, ps) for _, sink, ps in CLOCKS]
    sdf = delays(*pll, ("one/O", "p_DSP/A_3", 2000), ("p_DSP/O_20", "two/I0", 3000))
    assert slowest(sdf, netlist()) == pytest.approx(1.390 + 2 + 8.9 + 3 + 1.234)


def test_a_registered_input_of_another_block_ends_a_path() -> None:
    placed = netlist()
    (top,) = placed["modules"].values()
    parameters = {**top["cells"]["p"]["parameters"], "A_REG": "1"}
    top["cells"]["q"] = {"type": "SB_MAC16", "parameters": parameters}
    wires = (*CLOCKS, ("one/O", "p_DSP/A_3", 2000), ("p_DSP/O_20", "q_DSP/A_0", 3000))
    sdf = delays(*wires)
    sdf += sdf[sdf.index('(CELL (CELLTYPE "ICESTORM_DSP")') :].replace("p_DSP", "q_DSP")
    sdf += r"(INTERCONNECT \$gbuf_clk/GLOBAL_BUFFER_OUTPUT q_DSP/CLK (9:9:9) (9:9:9))"
    assert slowest(sdf, placed) == pytest.approx(1.390 + 2 + 8.9 + 3 + 0.1)


def test_registers_of_a_part_of_the_product_cut_no_path() -> None:
    sdf = delays(*CLOCKS, ("one/O", "p_DSP/A_3", 2000), ("p_DSP/O_20", "two/I0", 3000))
    whole = 1.390 + 2 + 8.9 + 3 + 1.234
    assert slowest(sdf, netlist(BOT_8x8_MULT_REG=1)) == pytest.approx(whole)
    parts = {"TOP_8x8_MULT_REG": 1, "BOT_8x8_MULT_REG": 1, "PIPELINE_16x16_MULT_REG1": 1}
    assert slowest(sdf, netlist(**parts)) == pytest.approx(8.9 + 3 + 1.234)
    assert slowest(sdf, netlist(PIPELINE_16x16_MULT_REG2=1)) == pytest.approx(8.9 + 3 + 1.234)


def test_what_controls_the_adder_passes_too() -> None:
    sdf = delays(*CLOCKS, ("one/O", "p_DSP/ADDSUBTOP", 2000), ("p_DSP/O_20", "two/I0", 3000))
    assert slowest(sdf, netlist()) == pytest.approx(1.390 + 2 + 4.0 + 3 + 1.234)


def test_a_registered_output_begins_later_than_nextpnr_says() -> None:
    sdf = delays(*CLOCKS, ("p_DSP/O_20", "two/I0", 3000))
    assert slowest(sdf, netlist(top="01")) == pytest.approx(1.6 + 3 + 1.234)


def test_pins_and_constants_begin_no_path() -> None:
    sdf = delays(*CLOCKS, ("pin/D_IN_0", "p_DSP/A_3", 20_000), ("p_DSP/O_20", "two/I0", 3000))
    assert slowest(sdf, netlist()) == pytest.approx(5.0)


def test_a_block_without_outputs_is_no_trouble() -> None:
    sdf = delays(*CLOCKS, ("one/O", "p_DSP/A_3", 2000))
    assert slowest(sdf, netlist(A_REG=1, TOP_8x8_MULT_REG=1)) == pytest.approx(8.9)


def test_a_circle_has_no_slowest_path() -> None:
    sdf = delays(*CLOCKS, ("p_DSP/O_20", "p_DSP/A_0", 3000))
    sentence = "paths through multiplier blocks must have an end, not lead back to where they begin"
    with pytest.raises(ToolError, match=f"^{sentence}$"):
        with_block_paths(report(), sdf, netlist())


def test_the_path_that_nextpnr_sees_stays_where_it_is_slower() -> None:
    sdf = delays(*CLOCKS, ("one/O", "p_DSP/A_3", 2000), ("p_DSP/O_20", "two/I0", 3000))
    assert slowest(sdf, netlist(), 10.0) == pytest.approx(100.0)


def test_the_steps_are_told_as_nextpnr_tells_them() -> None:
    sdf = delays(*CLOCKS, ("one/O", "p_DSP/A_3", 2000), ("p_DSP/O_20", "two/I0", 3000))
    (path,) = with_block_paths(report(), sdf, netlist())["critical_paths"]
    told = [(step["type"], step["delay"], step["to"]["cell"], step["to"]["port"]) for step in path["path"]]
    assert told == [
        ("clk-to-q", 1.39, "one", "O"),
        ("routing", 2.0, "p_DSP", "A_3"),
        ("logic", 8.9, "p_DSP", "O_20"),
        ("routing", 3.0, "two", "I0"),
        ("setup", 1.234, "two", "I0"),
    ]


def test_without_blocks_the_report_stays() -> None:
    plain = report()
    assert with_block_paths(plain, "", {"modules": {"t": {"attributes": {"top": "1"}, "cells": {}}}}) is plain
