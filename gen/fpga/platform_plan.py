"""What Amaranth's platform of a board makes of its top: files, and the commands that open or vendor's tools need."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from amaranth.build import Attrs, Pins, Resource, Subsignal
from amaranth.build.run import BuildPlan

from sosmith.gen.fpga.boards import Board, check_selects
from sosmith.gen.fpga.tools import EXTRA
from sosmith.hdl.boards.on_platform import SPI, OnPlatform
from sosmith.model.errors import ToolError

SEED = 1
"""Seed of the placer: the same input gives the same bitstream."""

_PIN_ATTRIBUTES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "ice40": ({"IO_STANDARD": "SB_LVCMOS"}, {"PULLUP": 1}),
    "ecp5": ({"IO_TYPE": "LVCMOS33"}, {"PULLMODE": "UP"}),
    "gowin": ({"IO_TYPE": "LVCMOS33"}, {"PULL_MODE": "UP"}),
    "xilinx": ({"IOSTANDARD": "LVCMOS33"}, {"PULLUP": "TRUE"}),
}
"""Attributes of a pin of 3.3 V, by family, and those of its pull-up."""


def board_plan(verilog: str, top: str, name: str, board: Board, selects: int) -> BuildPlan:
    """Return files and commands for a board, from its Amaranth platform.

    Parameters
    ----------
    verilog, top, board, selects
        As for `sosmith.gen.fpga.bitstream.build`.
    name : str
        Name of the design.

    Raises
    ------
    ToolError
        If amaranth-boards is missing.
    SpecificationError
        If the board has too few pins for the converters.
    """
    assert board.platform is not None
    check_selects(board, selects)
    module, _, kind = board.platform.partition(":")
    try:
        platform = getattr(import_module(module), kind)()
    except ModuleNotFoundError:
        raise ToolError(
            f"amaranth-boards is needed to build for a board, and was not found: pip install 'sosmith[{EXTRA}]'"
        ) from None
    _, _, options = board.device.synthesis.partition(" ")
    wishes = f"--seed {SEED} --freq {board.clock / 1e6:g} --timing-allow-fail --report report.json"
    platform.add_file(f"{top}.sv", verilog)
    if selects:
        platform.add_resources([_converters(board, selects)])
    return platform.prepare(
        OnPlatform(top, converters=selects > 0), name, emit_src=False, synth_opts=options, nextpnr_opts=wishes
    )


def _converters(board: Board, selects: int) -> Resource:
    """Return the pins of the converters; that of MISO has a pull-up."""
    sck, mosi, miso, *cs_n = board.header
    plain, pulled_up = _PIN_ATTRIBUTES[board.device.family]
    return Resource(
        SPI,
        0,
        Subsignal("sck", Pins(sck, dir="o"), Attrs(**plain)),
        Subsignal("mosi", Pins(mosi, dir="o"), Attrs(**plain)),
        Subsignal("miso", Pins(miso, dir="i"), Attrs(**plain, **pulled_up)),
        Subsignal("cs_n", Pins(" ".join(cs_n[:selects]), dir="o"), Attrs(**plain)),
    )


def text_of(plan: BuildPlan, file: str) -> str:
    """Return the text of a file of a plan."""
    content = plan.files[file]
    return content if isinstance(content, str) else content.decode()
