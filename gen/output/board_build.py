"""Builds a design for a board: bitstream, log, and `build.json` with utilisation and timing."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from sosmith.gen.fpga.bitstream import Bitstream, build, fingerprint
from sosmith.gen.fpga.boards import RATE, Board
from sosmith.gen.fpga.platform_plan import SEED
from sosmith.gen.output.board_top import Design, board_verilog, schedule_of, top_name, wiring_of
from sosmith.gen.output.identity import item_of
from sosmith.gen.version import __version__
from sosmith.model.text_files import to_json, write_contents


@dataclass(frozen=True)
class BoardBuild:
    """A design in an FPGA.

    Attributes
    ----------
    design : CoreDesign or BoardItem
        The design.
    rate : int
        Line rate in baud.
    verilog : str
        The board's top as SystemVerilog.
    core_verilog : str
        The core alone, whose digest the board tells.
    bitstream : Bitstream
        What the programs produced from it.
    """

    design: Design
    rate: int
    verilog: str
    core_verilog: str
    bitstream: Bitstream

    @property
    def board(self) -> Board:
        """The board."""
        return self.bitstream.board

    @property
    def passed(self) -> bool:
        """Whether timing closes."""
        return self.bitstream.met

    @property
    def shortfall(self) -> str:
        """Which clock does not close, and the path that does not."""
        clock, path = self.bitstream.slowest, self.bitstream.path
        steps = ", ".join(f"{step.kind} {step.delay:.2f} ns to {step.end}" for step in path)
        return (
            f"{item_of(self.design).name} must run at {clock.wanted:.2f} MHz on {self.board.title}, not "
            f"{clock.achieved:.2f} MHz: the path takes {sum(step.delay for step in path):.2f} ns: {steps}"
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The facts about it as a tree of JSON values: the content of ``build.json``."""
        bitstream = self.bitstream
        return build_facts(self.design, self.board, self.rate, self.core_verilog) | {
            "passed": bitstream.met,
            "bitstream": None
            if not bitstream.met
            else {
                "file": bitstream.file,
                "bytes": len(bitstream.content),
                "sha256": hashlib.sha256(bitstream.content).hexdigest(),
            },
            "utilisation": {kind: {"used": used, "available": there} for kind, (used, there) in bitstream.used.items()},
            "clocks": [
                {"name": clock.name, "achieved_mhz": clock.achieved, "wanted_mhz": clock.wanted}
                for clock in bitstream.clocks
            ],
            "slowest_path": [{"kind": step.kind, "ns": step.delay, "to": step.end} for step in bitstream.path],
            "seed": SEED,
            "tools": dict(bitstream.versions),
        }

    def write(self, folder: Path) -> list[Path]:
        """Write bitstream, the top's SystemVerilog, log and ``build.json``; without timing, remove an old bitstream.

        Raises
        ------
        SpecificationError
            If the folder cannot be written.
        ToolError
            If the disk is full.
        """
        bitstream = self.bitstream
        contents = {
            f"{top_name(self.design)}.sv": self.verilog.encode(),
            "build.log": bitstream.log.encode(),
            "build.json": to_json(self.summary).encode(),
        }
        if bitstream.met:
            contents = {bitstream.file: bitstream.content} | contents
        else:
            (folder / bitstream.file).unlink(missing_ok=True)
        return write_contents(folder, contents)


def build_facts(design: Design, board: Board, rate: int, core: str) -> dict[str, Any]:
    """Return what of ``build.json`` is known before anything is built.

    Parameters
    ----------
    design : CoreDesign or BoardItem
        The design.
    board : Board
        The board.
    rate : int
        Line rate in baud.
    core : str
        The core's SystemVerilog.
    """
    clock, item = wiring_of(design, board).clock(board), item_of(design)
    devices = [each.reading.converter.title for each in design.spec.converters]
    facts = {
        "name": item.name,
        "sosmith_version": __version__,
        "board": board.name,
        "title": board.title,
        "device": board.device.title,
        "design": hashlib.sha256(core.encode()).hexdigest(),
        "architecture": item.architecture,
        "channels": design.spec.channels,
        "clock_hz": int(clock) if clock.denominator == 1 else float(clock),
        "line_rate_baud": rate,
        "converters": devices if design.spec.dac is None else [*devices, design.spec.dac.converter.title],
        # what the core can take at the board's clock, but for the line
        "samples_per_second": float(clock) / (item.cycles_per_sample * design.spec.channels),
    }
    frame = schedule_of(design, clock).frame if design.spec.converters else None
    if frame is None:
        return facts
    return facts | {
        "sample_rate": {
            "hz": float(clock / frame.clocks),
            "ppm": round(float(frame.deviation(clock, design.spec.sample_rate)) * 1e6, 1),
            "mclk_hz": float(clock * frame.ratio / frame.clocks),
        }
    }


def build_board(
    design: Design,
    board: Board,
    *,
    rate: int = RATE,
    progress: Callable[[str], None] = lambda step: None,
) -> BoardBuild:
    """Build a design for a board; parameters beside these, and errors, as those of `sosmith.gen.fpga.bitstream.build`.

    Parameters
    ----------
    design : CoreDesign or BoardItem
        The design.
    rate : int
        Line rate in baud.

    Raises
    ------
    SpecificationError
        If the design does not fit the link.
    """
    core, verilog = texts(design, board, rate, progress)
    bitstream = build(verilog, top_name(design), board, progress, wiring=wiring_of(design, board))
    return BoardBuild(design, rate, verilog, core, bitstream)


def board_cost(
    design: Design, board: Board, cache: Path | None, progress: Callable[[str], None] = lambda step: None
) -> dict[str, Any]:
    """Return `BoardBuild.summary` of a design; what was built from the same text by the same programs is in `cache`.

    Parameters
    ----------
    design : CoreDesign or BoardItem
        The design.
    board : Board
        The board.
    cache : Path or None
        Folder of the summaries, created if missing; None to keep nothing.
    progress : callable
        Called with the name of each step.

    Raises
    ------
    SpecificationError, ShortfallError, ToolError
        As `build_board`.
    """
    core, verilog = texts(design, board, RATE, progress)
    name = f"{fingerprint(verilog, board)}.json"
    if cache is not None and (cache / name).exists():
        cached: dict[str, Any] = json.loads((cache / name).read_text(encoding="utf-8"))
        return cached
    bitstream = build(verilog, top_name(design), board, progress, wiring=wiring_of(design, board))
    summary = BoardBuild(design, RATE, verilog, core, bitstream).summary
    if cache is not None:
        write_contents(cache, {name: to_json(summary).encode()})
    return summary


def texts(design: Design, board: Board, rate: int, progress: Callable[[str], None]) -> tuple[str, str]:
    """Return the SystemVerilog of the core, and of the board's top."""
    progress("SystemVerilog of the board")
    item = item_of(design)
    core = item.verilog
    wiring = wiring_of(design, board)
    waits = wiring.pll is not None
    return core, board_verilog(item, clock=wiring.clock(board), rate=rate, core=core, waits=waits)
