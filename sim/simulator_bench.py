"""Runs a core in a simulator, in a process of its own, with random idle and back-pressure."""

from __future__ import annotations

import contextlib
import json
import os
import platform
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from sosmith.gen.output.core_facts import InterfaceFacts, StreamFacts
from sosmith.model.errors import ShortfallError, ToolError
from sosmith.sim.beats import Beats
from sosmith.sim.bench import BenchRun, Progress
from sosmith.sim.build_cache import BuildCache, cache_folder
from sosmith.sim.simulators import Simulator, find_simulator
from sosmith.sim.verilated_model import LIBRARY_SECONDS, Builder

_POLL_SECONDS = 0.05
_LOG_TAIL = 12  # lines of the log shown in an error
_ROOM = 1 << 16  # bytes; a disk with less is full


@dataclass(frozen=True, kw_only=True)
class SimulatorBench:
    """A bench in a simulator, which also checks the rules of AXI4-Stream; under cocotb but for CXXRTL.

    Attributes
    ----------
    source : Path
        The SystemVerilog file.
    interface : InterfaceFacts
        Streams and clocks of the core.
    build_dir : Path
        Folder for the simulation; an unchanged core is not rebuilt.
    simulator : str
        ``"verilator"``, ``"icarus"`` or ``"cxxrtl"``.
    seed : int
        Seed of the random handshakes.
    idle, stall : float
        Fractions of clocks without input and with back-pressure on the output, in [0, 1).
    waves : bool
        Whether to write a waveform to `build_dir`.
    compiled : bool
        Whether the long stream runs in a compiled loop: in Verilator and CXXRTL, and without a waveform. It is clock
        for clock that of Python.
    announce : callable
        Called with the name of a step that may take long.
    """

    source: Path
    interface: InterfaceFacts
    build_dir: Path
    simulator: str = "verilator"
    seed: int = 1
    idle: float = 0.3
    stall: float = 0.3
    waves: bool = False
    compiled: bool = True
    announce: Callable[[str], None] = lambda step: None

    @property
    def name(self) -> str:
        """Name of the simulator."""
        return self.simulator

    def run(self, sent: Beats, progress: Progress) -> BenchRun:
        """Reset the core, send it all beats of `sent`, and receive all their results.

        Raises
        ------
        ShortfallError
            If the core breaks a rule of AXI4-Stream; says which and where.
        ToolError
            If a tool is missing or fails.
        """
        folder = self.build_dir.resolve() / self.simulator
        folder.mkdir(parents=True, exist_ok=True)
        with _plain_path(folder) as plain:
            tool = find_simulator(self.simulator, plain / "bin")
            self._write_job(plain, tool)
            sent.save(plain / "sent.npy")
            self.announce(self._building(plain, tool))
            _run(
                plain,
                tool,
                sent.results(self.interface.samples_per_result, self.interface.copies_per_result, self.interface.rates),
                progress,
            )
        outcome = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        if outcome["failure"] is not None:
            raise ShortfallError(f"{self.interface.name} in {self.simulator}: {outcome['failure']}")
        return BenchRun(
            received=Beats.load(folder / "received.npy"),
            cycles=outcome["clocks"],
            seconds=outcome["seconds"],
            tools={
                self.simulator: tool.version,
                **({} if self.simulator == "cxxrtl" else {"cocotb": metadata.version("cocotb")}),
                "python": platform.python_version(),
            },
        )

    def _building(self, folder: Path, tool: Simulator) -> str:
        """Name the step of building, with its duration if it takes long."""
        step = f"building with {self.simulator}"
        if self.simulator == "verilator" and not _builder(tool, folder / "build").has_library():
            return f"{step}, which takes about {LIBRARY_SECONDS} s the first time"
        return step

    def _write_job(self, folder: Path, tool: Simulator) -> None:
        for name in ("result.json", "received.npy", "progress.txt"):
            (folder / name).unlink(missing_ok=True)
        optional, wide = optional_signals(self.interface), _is_wide(self.interface)
        job = {
            "folder": str(folder),
            "source": str(folder / "core.sv"),
            "top": self.interface.name,
            "simulator": tool.name,
            "version": tool.version,
            "seed": self.seed,
            "waves": self.waves,
            "ports": ports_of(self.interface),
            "signals": [*optional, *["wide"] * wide],
        }
        bench = {
            "tdest": "tdest" in optional,
            "tuser": "tuser" in optional,
            "seed": self.seed,
            "idle": self.idle,
            "stall": self.stall,
            "compiled": self.compiled and self.simulator != "icarus" and not self.waves and not wide,
            "latency_cycles": self.interface.latency_cycles,
            "reset_cycles": self.interface.reset_cycles,
            "samples_per_result": self.interface.samples_per_result,
            "copies_per_result": self.interface.copies_per_result,
            "rates": self.interface.rates,
            "tdata_bits": self.interface.outputs.width,
            "tuser_bits": self.interface.outputs.user_width,
            "zeros": self.interface.idle if tool.name == "icarus" else (),  # elsewhere inputs begin with 0
        }
        (folder / "core.sv").write_bytes(self.source.read_bytes())
        (folder / "job.json").write_text(json.dumps(job), encoding="utf-8")
        (folder / "bench.json").write_text(json.dumps(bench), encoding="utf-8")


def has_library() -> bool:
    """Whether Verilator's library has been compiled for earlier simulations, and need not be for the next one.

    Where there is one already, it is not asked whether it is that of the present Verilator and compiler.

    Raises
    ------
    ToolError
        If Verilator or the compiler is missing.
    """
    cache = cache_folder()
    if cache is not None and BuildCache(cache).has_any("library"):
        return True
    with tempfile.TemporaryDirectory(prefix="sosmith-") as folder:
        tool = find_simulator("verilator", Path(folder) / "bin")
        return _builder(tool, Path(folder)).has_library()


def _builder(tool: Simulator, folder: Path) -> Builder:
    try:
        return Builder(tool.version, tool.environment, folder)
    except subprocess.CalledProcessError as error:
        raise ToolError(f"{tool.name} {tool.version} failed: {error.stderr.strip()}") from None


def ports_of(interface: InterfaceFacts) -> list[str]:
    """Names of the ports that a bench drives and reads."""
    streams = {"s_axis": interface.inputs, "m_axis": interface.outputs}
    return ["aclk", "aresetn", *(f"{name}_{signal}" for name, each in streams.items() for signal in _signals(each))]


def optional_signals(interface: InterfaceFacts) -> list[str]:
    """Those of ``tdest`` and ``tuser`` that the output stream has."""
    return [name for name in ("tdest", "tuser") if name in _signals(interface.outputs)]


def _is_wide(interface: InterfaceFacts) -> bool:
    """Whether a signal of the streams has more than 64 bits, which the compiled loop cannot have."""
    return max(interface.inputs.width, interface.outputs.width, interface.outputs.user_width) > 64


def _signals(stream: StreamFacts) -> list[str]:
    """Names of the stream's signals, without prefix."""
    optional = {"tdest": stream.dest_width > 0, "tuser": bool(stream.flags)}
    return ["tdata", "tvalid", "tready", *(name for name, present in optional.items() if present)]


@contextlib.contextmanager
def _plain_path(folder: Path) -> Iterator[Path]:
    """Yield a folder that all tools can build in: `folder`, or a temporary one if its path contains spaces or such."""
    if re.fullmatch(r"[\w./+-]+", str(folder)):
        yield folder
        return
    with tempfile.TemporaryDirectory(prefix="sosmith-") as scratch:
        try:
            yield Path(scratch)
        finally:
            shutil.copytree(scratch, folder, dirs_exist_ok=True)


def _run(folder: Path, tool: Simulator, total: int, progress: Progress) -> None:
    """Run the bench's process until it ends or is interrupted; it never outlives this call."""
    log = folder / "log.txt"
    command = [sys.executable, "-m", "sosmith.sim.bench_process", str(folder)]
    with log.open("w", encoding="utf-8") as output:
        # In a session of its own, so that all processes of simulator and compilers can be terminated together.
        process = subprocess.Popen(
            command,
            stdout=output,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            env=tool.environment,
            cwd=folder,
            start_new_session=True,
        )
        try:
            while process.poll() is None:
                time.sleep(_POLL_SECONDS)
                with contextlib.suppress(OSError, ValueError):
                    progress(int((folder / "progress.txt").read_text(encoding="utf-8")), total)
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
    if not (folder / "result.json").exists():
        if shutil.disk_usage(folder).free < _ROOM:  # the log has not taken what the tools said of it
            raise ToolError(f"{folder}: the disk must have room for the simulation, not be full")
        tail = "\n".join(log.read_text(encoding="utf-8", errors="replace").splitlines()[-_LOG_TAIL:])
        raise ToolError(f"{tool.name} {tool.version} failed; the end of {log}:\n{tail}")
    progress(total, total)
