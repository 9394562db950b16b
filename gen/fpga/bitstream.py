"""Makes a bitstream from the top of a board: synthesis, placement, timing, packing."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from sosmith.gen.fpga.block_paths import with_block_paths
from sosmith.gen.fpga.block_registers import with_block_registers
from sosmith.gen.fpga.boards import Board
from sosmith.gen.fpga.kept_bitstreams import Made, kept_or_made
from sosmith.gen.fpga.lost_drivers import check_drivers
from sosmith.gen.fpga.platform_plan import DELAYS, SEED, board_plan, text_of
from sosmith.gen.fpga.tools import Tool, find_tool
from sosmith.gen.fpga.wiring import PLAIN, Wiring
from sosmith.model.errors import ShortfallError, ToolError

_SUFFIX = {"ice40": "bin", "ecp5": "bit", "gowin": "fs", "gatemate": "bit"}
"""Suffix of a bitstream's file, by family."""

_PROGRAMS = {
    "ice40": ("yosys", "nextpnr-ice40", "icepack"),
    "ecp5": ("yosys", "nextpnr-ecp5", "ecppack"),
    "gowin": ("yosys", "nextpnr-himbaechel-gowin", "gowin_pack"),
    "gatemate": ("yosys", "nextpnr-himbaechel-gatemate", "gmpack"),
}
"""What makes a bitstream, by family."""

_STEPS = {"yosys": "synthesis", **dict.fromkeys(("icepack", "ecppack", "gowin_pack", "gmpack"), "packing")}
_LOG = "build.log"
_LOG_TAIL = 12  # lines of a program's output shown in an error
_ERROR = re.compile(r"^ERROR: (.*)$", re.MULTILINE)
_USED = re.compile(r"^Info:\s+(\w+):\s+(\d+)/\s*(\d+)\s+\d+%$", re.MULTILINE)


@dataclass(frozen=True)
class Clock:
    """A clock: its name, the highest frequency that the placed design takes, and the one it has, in MHz."""

    name: str
    achieved: float
    wanted: float

    @property
    def met(self) -> bool:
        """Whether timing closes."""
        return self.achieved >= self.wanted


@dataclass(frozen=True)
class Step:
    """A step of a path: a wire or what a cell does, in ns, and where it ends."""

    kind: str
    delay: float
    end: str


@dataclass(frozen=True, kw_only=True)
class Bitstream:
    """A design in an FPGA.

    Attributes
    ----------
    board : Board
        The board.
    name : str
        Name of the design.
    content : bytes
        The bitstream, whether or not timing closes.
    used : dict of str to tuple of int
        Number of cells that are used, and that there are, by their kind in the placer.
    clocks : tuple of Clock
        All clocks.
    path : tuple of Step
        The slowest path between two registers.
    versions : dict of str to str
        Version of each program.
    log : str
        All that the programs said.
    """

    board: Board
    name: str
    content: bytes
    used: dict[str, tuple[int, int]]
    clocks: tuple[Clock, ...]
    path: tuple[Step, ...]
    versions: dict[str, str]
    log: str

    @property
    def file(self) -> str:
        """Name of the bitstream's file."""
        return f"{self.name}.{_SUFFIX[self.board.device.family]}"

    @property
    def met(self) -> bool:
        """Whether timing closes."""
        return all(clock.met for clock in self.clocks)

    @property
    def slowest(self) -> Clock:
        """The clock with the least margin."""
        return min(self.clocks, key=lambda clock: clock.achieved / clock.wanted)


def fingerprint(verilog: str, board: Board) -> str:
    """Return a digest of all that a bitstream depends on: SystemVerilog, board, and the programs' versions.

    Raises
    ------
    ToolError
        If a program is missing.
    """
    versions = [find_tool(name).version for name in _PROGRAMS[board.device.family]]
    parts = [verilog, repr(board), *versions, metadata.version("amaranth"), str(SEED)]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def build(
    verilog: str,
    top: str,
    board: Board,
    progress: Callable[[str], None] = lambda step: None,
    *,
    wiring: Wiring = PLAIN,
) -> Bitstream:
    """Make a bitstream; takes some tens of seconds, and a minute more on the very first call.

    Two calls with the same programs give the same bytes; the second one finds what the first one has made.

    Parameters
    ----------
    verilog : str
        SystemVerilog of what goes into the FPGA.
    top : str
        Its top module, with the ports of `sosmith.hdl.boards.board_top.BoardTop`, for the clock of `wiring`.
    board : Board
        The board.
    progress : callable
        Called with the name of each step.
    wiring : Wiring
        Pins of its converters, and what makes its clock.

    Raises
    ------
    ToolError
        If a program is missing or fails.
    SpecificationError
        If the board has too few pins for the converters.
    ShortfallError
        If the design has more cells than the FPGA, or cannot be placed for another reason.
    """
    name = f"{top}_{board.name}"
    plan = board_plan(verilog, top, name, board, wiring)
    commands = [_translated(command) for command in json.loads(text_of(plan, f"build_{name}.json"))["commands"]]
    tools = {command[0]: find_tool(command[0]) for command in commands}
    files = {file: text_of(plan, file).encode() for file in plan.files}
    versions = {tool.name: tool.version for tool in tools.values()}
    made = kept_or_made(files, commands, versions, lambda: _made(files, commands, tools, name, board, progress))
    return Bitstream(
        board=board,
        name=name,
        content=made.content,
        used={
            kind: (cells["used"], cells["available"])
            for kind, cells in sorted(made.report["utilization"].items())
            if cells["available"]
        },
        clocks=tuple(
            Clock(clock, round(timing["achieved"], 2), round(timing["constraint"], 2))
            for clock, timing in sorted(made.report["fmax"].items())
        ),
        path=_slowest_path(made.report),
        versions=versions,
        log=made.log,
    )


def _made(
    files: Mapping[str, bytes],
    commands: Sequence[Sequence[str]],
    tools: Mapping[str, Tool],
    name: str,
    board: Board,
    progress: Callable[[str], None],
) -> Made:
    """Call the programs, one after the other, in a folder with the files."""
    with TemporaryDirectory(prefix="sosmith-") as scratch:
        place = Path(scratch)
        for file, content in files.items():
            (place / file).write_bytes(content)
        for command in commands:
            progress(_STEPS.get(command[0], "placement and routing"))
            _carry_out(tools[command[0]], command[1:], place, board)
            if command[0] == "yosys":
                _pack(place / f"{name}.json")
        report = json.loads((place / "report.json").read_text(encoding="utf-8"))
        if board.device.multiplier == "SB_MAC16":
            netlist = json.loads((place / f"{name}.json").read_text(encoding="utf-8"))
            report = with_block_paths(report, (place / DELAYS).read_text(encoding="utf-8"), netlist)
        bitstream = place / f"{name}.{_SUFFIX[board.device.family]}"
        return Made(bitstream.read_bytes(), report, _read(place / _LOG))


def _pack(netlist: Path) -> None:
    """Move registers into the blocks beside them, where Yosys leaves them outside; look for what it has lost."""
    if netlist.exists():  # none for what Amaranth hands on otherwise
        mapped = json.loads(netlist.read_text(encoding="utf-8"))
        check_drivers(mapped)
        packed = with_block_registers(mapped)
        netlist.write_text(json.dumps(packed), encoding="utf-8")


def _translated(command: Sequence[str]) -> list[str]:
    """Return a command of Amaranth for the programs that there are: nextpnr-gowin has become a part of another one."""
    words = [word for word in command if word not in {"-q", "--quiet"}]
    if words[0] != "nextpnr-gowin":
        return words
    options = {"--family": "family", "--cst": "cst"}
    translated = ["nextpnr-himbaechel-gowin"]
    rest = iter(words[1:])
    for word in rest:
        translated += ["--vopt", f"{options[word]}={next(rest)}"] if word in options else [word]
    return translated


def _carry_out(tool: Tool, arguments: Sequence[str], folder: Path, board: Board) -> None:
    """Run a program in `folder`; its output goes to the log there."""
    log = folder / _LOG
    if tool.run(arguments, folder, log) == 0:
        return
    said = _read(log).rpartition(f"$ {tool.name} ")[2]
    if tool.name.startswith("nextpnr") and (errors := _ERROR.findall(said)):
        cells = [(kind, int(used), int(there)) for kind, used, there in _USED.findall(said)]
        excess = [f"{used:,} {kind} of {there:,}" for kind, used, there in cells if used > there]
        raise ShortfallError(f"the design must fit the {board.title}, but: {', '.join(excess) or errors[0]}")
    tail = "\n".join(said.splitlines()[-_LOG_TAIL:])
    raise ToolError(f"{tool.name} {tool.version} failed:\n{tail}")


def _slowest_path(report: dict[str, Any]) -> tuple[Step, ...]:
    """Return the path between registers with the longest delay."""
    inside = [
        candidate["path"]
        for candidate in report["critical_paths"]
        if "<async>" not in candidate["from"] + candidate["to"]
    ]
    if not inside:
        return ()
    longest = max(inside, key=lambda path: sum(step["delay"] for step in path))
    return tuple(Step(step["type"], round(step["delay"], 3), step["to"]["cell"]) for step in longest)


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace")
