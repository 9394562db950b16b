"""Runs a core in Verilator that is reset, and has other constants loaded, while samples stream through it."""

from __future__ import annotations

import itertools
import random
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from amaranth.hdl import Shape
from amaranth.lib.wiring import In

from sosmith.gen.core import CoreDesign
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.gen.reload.register_writes import register_writes
from sosmith.gen.reload.reload import OtherSet
from sosmith.hdl.plan.streams import fields
from sosmith.model.arrays import Codes
from sosmith.sim.simulators import find_simulator
from sosmith.sim.verilated_model import Builder

_MAIN = Path(__file__).with_name("restarts_main.cpp")


@dataclass(frozen=True, eq=False)
class Outcome:
    """What came out, and after which start.

    Attributes
    ----------
    resets, loads : integer array, one for each start
        Number of the last reset, and of the set in use; -1 for the core's own.
    start, channel, index : integer array, one for each result
        The start before its sample, its channel, and how many samples of the channel came between.
    data, status : integer array, one for each result
        ``tdata`` and ``tuser``.
    """

    resets: npt.NDArray[np.int64]
    loads: npt.NDArray[np.int64]
    start: npt.NDArray[np.int64]
    channel: npt.NDArray[np.int64]
    index: npt.NDArray[np.int64]
    data: npt.NDArray[np.int64]
    status: npt.NDArray[np.int64]

    @property
    def reloads(self) -> int:
        """Number of starts by other constants: the others are by a reset."""
        return int(np.count_nonzero(np.diff(self.resets) == 0))


def script(
    starts: int, loads: Sequence[int], settled: int, constants: Sequence[str], chance: random.Random
) -> list[str]:
    """Return commands for at least so many resets and reloads; some come at once, before, or in the middle of a load.

    Parameters
    ----------
    starts : int
        Their number.
    loads : sequence of int
        Number of writes of each load.
    settled : int
        Samples after a start that every fourth one waits for, at least.
    constants : sequence of str
        What follows ``reset``, for each one in turn.
    chance : Random
        For all that is left to it.
    """
    lines: list[str] = []
    following = itertools.cycle(constants)
    while starts > 0:
        lines += [f"reset {next(following)}", *_waited(settled, chance)]
        starts -= 1
        for _ in range(chance.randrange(6)):
            lines += [f"write {chance.randrange(len(loads))}", *_waited(settled, chance)]
            starts -= 1
        if chance.randrange(4) == 0:
            load = chance.randrange(len(loads))
            lines.append(f"begin {load} {chance.randrange(1, loads[load])}")
    return lines


def _waited(settled: int, chance: random.Random) -> Iterator[str]:
    kind = chance.randrange(4)
    if kind == 0:
        yield f"samples {settled + 2}"
    elif kind == 1:
        yield f"clocks {chance.randrange(400)}"
    else:
        yield f"samples {chance.randrange(4)}"


def run(folder: Path, made: CoreDesign, sets: Sequence[OtherSet], starts: int, codes: Codes, seed: int) -> Outcome:
    """Simulate a core; each reset has the next of the constant samples, in turn.

    Parameters
    ----------
    folder : Path
        For the files.
    made : CoreDesign
        The core.
    sets : sequence of OtherSet
        What is loaded.
    starts : int
        Number of resets and reloads, at least.
    codes : integer array, shape (resets, channels, inputs)
        The constant samples.
    seed : int
        Of the order of events.
    """
    channels, ports = made.architecture.channels, fields(made.datapath.inputs)
    constants = [
        " ".join(
            f"{sum(int(c) % (1 << f.padded) << f.offset for f, c in zip(ports, sample, strict=True)):x}"
            for sample in row
        )
        for row in codes
    ]
    writes = [register_writes(made, other, number) for number, other in enumerate(sets)]
    lines = ["load " + " ".join(f"{register.address} {word}" for register, word in each) for each in writes]
    lines += script(starts, [len(each) for each in writes], made.quantized.settling, constants, random.Random(seed))
    program = _built(folder, made)
    done = subprocess.run([program], input="\n".join(lines) + "\n", capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    begun = [line.split()[1:] for line in done.stdout.splitlines() if line.startswith("start")]
    beats = [line.split() for line in done.stdout.splitlines() if not line.startswith("start")]
    resets, loads = np.array(begun, dtype=np.int64).T
    start, channel = np.array([beat[:2] for beat in beats], dtype=np.int64).T
    data, status = (np.array([int(beat[k], 16) for beat in beats]) for k in (2, 3))
    group = start * channels + channel
    order = np.argsort(group, kind="stable")
    first = np.concatenate([[0], np.flatnonzero(np.diff(group[order])) + 1])
    index = np.empty_like(group)
    index[order] = np.arange(len(group)) - np.repeat(first, np.diff([*first, len(group)]))
    return Outcome(resets, loads, start, channel, index, data, status)


def _built(folder: Path, made: CoreDesign) -> Path:
    """Build the core in a module that shows which bank is active."""
    component, name = made.architecture.component(), made.datapath.name
    members = component.signature.members
    ports = [
        f"{'input' if member.flow is In else 'output'} wire [{Shape.cast(member.shape).width - 1}:0] {port}"
        for port, member in members.items()
    ]
    top = [
        f"module top({', '.join(ports)}, output wire bank);",
        f"{name} core({', '.join(f'.{port}({port})' for port in members)});",
        "assign bank = core.reload_port.bank;",
        "endmodule\n",
    ]
    source, header, program = folder / "top.sv", folder / "restarts.h", folder / "program"
    source.write_text(to_verilog(to_rtlil(component, name)) + "\n".join(top))
    several = made.architecture.channels > 1
    header.write_text(
        f"#define SET_DEST(port, value) {'port = value' if several else '(void)(value)'}\n"
        f"#define GET_DEST(port, value) {'(port)' if several else '(value)'}\n"
        f"constexpr int kChannels = {made.architecture.channels};\n"
    )
    tool = find_simulator("verilator", folder / "bin")
    (folder / "build").mkdir(exist_ok=True)
    with (folder / "build.log").open("w") as log:
        Builder(tool.version, tool.environment, folder / "build", log).build_program(
            source, "top", _MAIN, header, program
        )
    return program
