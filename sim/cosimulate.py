"""Runs a generated core in a simulator under cocotb, from an array of input codes to an array of output codes."""

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
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Codes
from sosmith.model.errors import ShortfallError, ToolError
from sosmith.sim.simulators import Simulator, find_simulator

_POLL_SECONDS = 0.05
_BLOCK = 8  # samples of each channel in turn, then as many shuffled
_LOG_TAIL = 12  # lines of the log that an error shows


@dataclass(frozen=True, kw_only=True)
class CosimulationResult:
    """What came out of the simulated hardware.

    Attributes
    ----------
    codes : int64 array, shape (samples, channels, outputs)
        Output codes.
    status : uint8 array, shape (samples, channels)
        Status of the outputs, 0 where the core gives none.
    cycles : int
        Clocks from the end of reset to the last sample received.
    wall_seconds : float
        Duration of build and run.
    cycles_per_second : float
        Speed of the run, its start-up included.
    simulator : str
        Name of the simulator.
    tools : dict of str to str
        Versions of simulator, cocotb and Python.
    """

    codes: Codes
    status: npt.NDArray[np.uint8]
    cycles: int
    wall_seconds: float
    cycles_per_second: float
    simulator: str
    tools: dict[str, str]


def cosimulate(
    sv: Path,
    manifest: Mapping[str, Any],
    codes: Codes,
    *,
    build_dir: Path,
    simulator: str = "verilator",
    seed: int = 1,
    idle: float = 0.3,
    stall: float = 0.3,
    waves: bool = False,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> CosimulationResult:
    """Run `codes` through the core in `sv` with random idle and back-pressure, and check the stream's rules.

    Parameters
    ----------
    sv : Path
        The SystemVerilog file.
    manifest : mapping
        The core's manifest: name, streams, latency and clocks after a reset.
    codes : int64 array, shape (samples, channels, inputs)
        Input codes, at least one sample. Several channels come in an order that changes from the one after the other
        to any at all.
    build_dir : Path
        Folder for the simulation; an unchanged core is not built again.
    simulator : str
        ``"verilator"`` or ``"icarus"``.
    seed : int
        Seed of the handshakes.
    idle, stall : float
        Share of clocks without input and with the output held up, 0 to below 1.
    waves : bool
        Leave a waveform in `build_dir`.
    progress : callable
        Told the samples received and their total.

    Raises
    ------
    ShortfallError
        If the core breaks a rule of AXI4-Stream, or hands out a sample as another channel's; says which and where.
    ToolError
        If a tool is missing or fails.
    """
    started = time.monotonic()
    folder = build_dir.resolve() / simulator
    folder.mkdir(parents=True, exist_ok=True)
    inputs, outputs = manifest["streams"]["s_axis"], manifest["streams"]["m_axis"]
    with _plain_path(folder) as plain:
        tool = find_simulator(simulator, plain / "bin")
        _write_job(plain, sv, manifest, tool, seed=seed, idle=idle, stall=stall, waves=waves)
        samples, channels, _ = codes.shape
        order = _order(samples, channels, seed)
        words = _pack(codes[_turns(order), order], inputs)
        sent = "\n".join(f"{channel:x} {word:x}" for channel, word in zip(order.tolist(), words, strict=True))
        (plain / "words.txt").write_text(sent, encoding="utf-8")
        _run(plain, tool, len(words), progress)
    outcome = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    if outcome["failure"] is not None:
        raise ShortfallError(f"{manifest['name']} in {simulator}: {outcome['failure']}")
    lines = (folder / "received.txt").read_text(encoding="utf-8").splitlines()
    received = [[int(value, 16) for value in line.split()] for line in lines]
    _check_channels([dest for dest, _, _ in received], order)
    result = np.empty((samples, channels, len(outputs["fields"])), dtype=np.int64)
    status = np.empty((samples, channels), dtype=np.uint8)
    result[_turns(order), order] = _unpack([word for _, word, _ in received], outputs)
    status[_turns(order), order] = [user for _, _, user in received]
    return CosimulationResult(
        codes=result,
        status=status,
        cycles=outcome["clocks"],
        wall_seconds=time.monotonic() - started,
        cycles_per_second=outcome["clocks"] / outcome["seconds"],
        simulator=simulator,
        tools={simulator: tool.version, "cocotb": metadata.version("cocotb"), "python": platform.python_version()},
    )


def _order(samples: int, channels: int, seed: int) -> npt.NDArray[np.int64]:
    """Channel of each sample sent, shape (samples * channels,): in turn, and shuffled among some samples of each."""
    rng = np.random.default_rng(seed)
    blocks = []
    for start in range(0, samples, _BLOCK):
        block = np.tile(np.arange(channels), min(_BLOCK, samples - start))
        blocks.append(rng.permutation(block) if start // _BLOCK % 2 else block)
    return np.concatenate(blocks)


def _turns(order: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Index of each sample within its channel, shape as `order`."""
    turns = np.empty_like(order)
    for channel in range(int(order.max()) + 1):
        mine = np.flatnonzero(order == channel)
        turns[mine] = np.arange(len(mine))
    return turns


def _check_channels(received: list[int], order: npt.NDArray[np.int64]) -> None:
    for index, (found, expected) in enumerate(zip(received, order.tolist(), strict=True)):
        if found != expected:
            raise ShortfallError(f"m_axis_tdest must be {expected}, not {found}, at output {index}")


@contextlib.contextmanager
def _plain_path(folder: Path) -> Iterator[Path]:
    """Give a folder that makefiles can build in: `folder`, or a passing one if its path has a space or the like."""
    if re.fullmatch(r"[\w./+-]+", str(folder)):
        yield folder
        return
    with tempfile.TemporaryDirectory(prefix="sosmith-") as scratch:
        try:
            yield Path(scratch)
        finally:
            shutil.copytree(scratch, folder, dirs_exist_ok=True)


def _write_job(folder: Path, sv: Path, manifest: Mapping[str, Any], tool: Simulator, **options: Any) -> None:
    for name in ("result.json", "received.txt", "progress.txt"):
        (folder / name).unlink(missing_ok=True)
    inputs, outputs = manifest["streams"]["s_axis"], manifest["streams"]["m_axis"]
    optional = {name: name in outputs for name in ("tdest", "tuser")}
    ports = ["aclk", "aresetn", *(f"s_axis_{name}" for name in _signals(inputs))]
    ports += [f"m_axis_{name}" for name in _signals(outputs)]
    job = {
        "folder": str(folder),
        "source": str(folder / "core.sv"),
        "top": manifest["name"],
        "simulator": tool.name,
        "version": tool.version,
        "seed": options["seed"],
        "waves": options["waves"],
        "ports": ports,
    }
    bench = optional | {key: options[key] for key in ("seed", "idle", "stall")}
    bench |= {key: manifest[key] for key in ("latency_cycles", "reset_cycles")}
    (folder / "core.sv").write_bytes(sv.read_bytes())
    (folder / "job.json").write_text(json.dumps(job), encoding="utf-8")
    (folder / "bench.json").write_text(json.dumps(bench), encoding="utf-8")


def _signals(stream: Mapping[str, Any]) -> list[str]:
    return ["tdata", "tvalid", "tready", *(name for name in ("tdest", "tuser") if name in stream)]


def _run(folder: Path, tool: Simulator, total: int, progress: Callable[[int, int], None]) -> None:
    """Run the bench's process to its end, however that comes about; it never outlives this call."""
    log = folder / "log.txt"
    command = [sys.executable, "-m", "sosmith.sim.bench_process", str(folder)]
    with log.open("w", encoding="utf-8") as output:
        # A session of its own: the simulator's and compilers' processes can be ended all together.
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
        tail = "\n".join(log.read_text(encoding="utf-8", errors="replace").splitlines()[-_LOG_TAIL:])
        raise ToolError(f"{tool.name} {tool.version} failed; the end of {log}:\n{tail}")
    progress(total, total)


def _pack(codes: Codes, stream: Mapping[str, Any]) -> list[int]:
    """Words on the bus: each field's code, extended by its sign to whole bytes."""
    words = [0] * len(codes)
    for column, field in zip(codes.T.tolist(), stream["fields"], strict=True):
        padded = (field["width"] + 7) // 8 * 8
        mask, offset = (1 << padded) - 1, field["offset"]
        words = [word | (code & mask) << offset for word, code in zip(words, column, strict=True)]
    return words


def _unpack(words: list[int], stream: Mapping[str, Any]) -> Codes:
    """Codes of every field, checked to be extended by their sign to whole bytes."""
    columns = []
    for field in stream["fields"]:
        padded = (field["width"] + 7) // 8 * 8
        column = [word >> field["offset"] & (1 << padded) - 1 for word in words]
        if field["signed"]:
            column = [code - (1 << padded) if code >> (padded - 1) else code for code in column]
        low = -(1 << (field["width"] - 1)) if field["signed"] else 0
        for index, code in enumerate(column):
            if not low <= code < low + (1 << field["width"]):
                raise ShortfallError(
                    f"{field['name']} must be extended to whole bytes, not {words[index]:#x} at sample {index}"
                )
        columns.append(column)
    return np.array(columns, dtype=np.int64).T
