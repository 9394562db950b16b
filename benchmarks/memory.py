"""Memory of long runs: the most that a command and its processes take at a time: `python -m benchmarks.memory`.

A trace of ten million samples is written to a file, read from it, and simulated; and one that is built in is simulated.
Writes docs/speed.md.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from benchmarks.speed_page import ROOT, Benchmark

SAMPLES = 10_000_000
LIMIT = 600.0
"""Most MB that a process may take."""

_EXAMPLE = ROOT / "examples" / "audio_lowpass.toml"
_RATE = 48_000
_SECONDS = f"{SAMPLES // _RATE}"
_SIMULATE = ("simulate", "spec.toml", "-q", "--idle", "0", "--stall", "0", "-o", "out")
COMMANDS: dict[str, tuple[str, ...]] = {
    "a trace is written": ("emulate", "spec.toml", "noise", "-q", "--seconds", _SECONDS, "-o", "trace.csv"),
    "it is read and simulated": (*_SIMULATE, "--trace", "trace.csv"),
    "a built-in trace is simulated": (*_SIMULATE, "--seconds", _SECONDS),
}


@dataclass(frozen=True)
class Memory:
    """A run.

    Attributes
    ----------
    what : str
        A key of `COMMANDS`.
    samples : int
        Length of the trace.
    peak : float
        Most resident memory of a process of the command, in MB.
    seconds : float
        CPU time of all its processes.
    """

    what: str
    samples: int
    peak: float
    seconds: float


def measured() -> list[Memory]:
    """Run all commands, each on what the ones before have written."""
    samples = SAMPLES // _RATE * _RATE
    with tempfile.TemporaryDirectory() as folder:
        text = _EXAMPLE.read_text(encoding="utf-8").replace('architecture = "auto"', 'architecture = "parallel"')
        (Path(folder) / "spec.toml").write_text(text, encoding="utf-8")
        return [Memory(what, samples, *usage(command, Path(folder))) for what, command in COMMANDS.items()]


def usage(command: tuple[str, ...], folder: Path) -> tuple[float, float]:
    """Run a command of ours in a folder; return its peak of memory in MB, and its CPU time in s."""
    process = subprocess.Popen(
        [sys.executable, "-m", "sosmith.cli", *command], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )
    assert process.stderr is not None
    told = process.stderr.read().decode(errors="replace")
    _, status, used = os.wait4(process.pid, 0)  # of the process and all that it has waited for
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"{' '.join(command)} must end well, not with {process.returncode}: {told}")
    return used.ru_maxrss / 1e3, used.ru_utime + used.ru_stime


def tables(rows: list[Memory]) -> str:
    """Return the table in Markdown."""
    head = "| | samples | most memory, MB | CPU, s |\n|---|---:|---:|---:|\n"
    return head + "".join(f"| {row.what} | {row.samples:,} | {row.peak:.0f} | {row.seconds:.0f} |\n" for row in rows)


def section(rows: list[Memory]) -> str:
    """Return the section of the document."""
    return f"""
## Memory of long runs

The most resident memory of any process of a command, for audio_lowpass in the parallel architecture; a CSV file is
read and written in pieces, and a run keeps what it cannot make again. `python -m benchmarks.memory`, with `--check`
status 1 if one takes more than {LIMIT:g} MB.

{tables(rows)}
"""


def losses(old: list[Memory], new: list[Memory]) -> list[str]:
    """Say which run takes too much."""
    return [
        f"{row.what}: memory must be at most {LIMIT:g} MB, not {row.peak:.0f} MB" for row in new if row.peak > LIMIT
    ]


BENCHMARK = Benchmark(
    name="memory",
    row=Memory,
    measure=lambda _repeats: measured(),
    section=section,
    tables=tables,
    losses=losses,
)

if __name__ == "__main__":
    BENCHMARK.main(__doc__, repeats=1)
