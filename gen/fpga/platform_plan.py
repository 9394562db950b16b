"""What Amaranth's platform of a board makes of its top: files, and the commands that open or vendor's tools need."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from amaranth.build import Attrs, Pins, Resource, Subsignal
from amaranth.build.run import BuildPlan

from sosmith.gen.fpga.boards import Board
from sosmith.gen.fpga.tools import EXTRA
from sosmith.gen.fpga.wiring import Wiring
from sosmith.hdl.boards.on_platform import AUDIO, DACS, INPUTS, SPI, OnPlatform
from sosmith.model.errors import ToolError

SEED = 1
"""Seed of the placer: the same input gives the same bitstream."""

DELAYS = "delays.sdf"
"""File with the delays of a placed iCE40."""

_PIN_ATTRIBUTES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "ice40": ({"IO_STANDARD": "SB_LVCMOS"}, {"PULLUP": 1}),
    "ecp5": ({"IO_TYPE": "LVCMOS33"}, {"PULLMODE": "UP"}),
    "gowin": ({"IO_TYPE": "LVCMOS33"}, {"PULL_MODE": "UP"}),
    "gatemate": ({}, {"PULLUP": "true"}),
    "xilinx": ({"IOSTANDARD": "LVCMOS33"}, {"PULLUP": "TRUE"}),
}
"""Attributes of a pin of 3.3 V, by family, and those of its pull-up."""


def board_plan(verilog: str, top: str, name: str, board: Board, wiring: Wiring) -> BuildPlan:
    """Return files and commands for a board, from its Amaranth platform.

    Parameters
    ----------
    verilog, top, board, wiring
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
    pins = {SPI: wiring.spi_pins(board), AUDIO: wiring.audio_pins(board), DACS: wiring.dac_pins(board)}
    module, _, kind = board.platform.partition(":")
    try:
        platform = getattr(import_module(module), kind)()
    except ModuleNotFoundError:
        raise ToolError(
            f"amaranth-boards is needed to build for a board, and was not found: pip install 'sosmith[{EXTRA}]'"
        ) from None
    _, _, options = board.device.synthesis.partition(" ")
    wishes = f"--seed {SEED} --freq {float(wiring.clock(board)) / 1e6:g} --timing-allow-fail --report report.json"
    if board.device.family == "ice40":
        wishes += f" --sdf {DELAYS}"
    platform.add_file(f"{top}.sv", verilog)
    for resource, signals in pins.items():
        if signals:
            platform.add_resources([_converters(resource, signals, board.device.family)])
    names = {resource: tuple(signals) for resource, signals in pins.items() if signals}
    top_level = OnPlatform(top, converters=names, pll=wiring.pll)
    return platform.prepare(top_level, name, emit_src=False, synth_opts=options, nextpnr_opts=wishes)


def _converters(name: str, pins: dict[str, tuple[str, ...]], family: str) -> Resource:
    """Return the pins of converters; those of inputs have a pull-up."""
    plain, pulled_up = _PIN_ATTRIBUTES[family]
    parts = [
        Subsignal(
            signal,
            Pins(" ".join(places), dir="i" if signal in INPUTS else "o"),
            Attrs(**plain, **pulled_up) if signal in INPUTS else Attrs(**plain),
        )
        for signal, places in pins.items()
    ]
    return Resource(name, 0, *parts)


def text_of(plan: BuildPlan, file: str) -> str:
    """Return the text of a file of a plan."""
    content = plan.files[file]
    return content if isinstance(content, str) else content.decode()
