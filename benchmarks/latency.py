"""Latency of a monitor on a fast line, over a pseudo-terminal: `python -m benchmarks.latency`.

The board is a model that measures by itself, in a process of its own, behind a line that takes as long for its bytes as
3 Mbaud do. Latency is from when a result was measured to when it is in the recording. Writes docs/speed.md.
"""

from __future__ import annotations

import os
import select
import signal
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from benchmarks.speed_page import Benchmark
from tests.host.measuring import MeasuringDevice, measuring_identity

from sosmith.host.board import Board
from sosmith.host.monitor import Received, watch
from sosmith.host.run_recording import RunRecording
from sosmith.model.arrays import Codes
from sosmith.model.link.identity import Identity
from sosmith.sim.virtual_board.terminal import Terminal

CHANNELS, RATE, BAUD, SECONDS = 12, 100.0, 3_000_000, 60.0
LATEST = 250.0
"""Most ms that all but one in a thousand results may take."""

_BITS = 10  # of a byte on the line
_NUMBERS = 256  # results are their sample numbers, modulo this


@dataclass(frozen=True)
class Latency:
    """A run.

    Attributes
    ----------
    baud : int
        Bits per second on the line.
    channels, rate : int, float
        Of the board; the rate in Hz for each channel.
    results : int
        What came.
    missed : int
        Samples that were overwritten before they were fetched.
    median, late, latest : float
        Latency in ms: of half of the results, of all but one in a thousand, and of all.
    """

    baud: int
    channels: int
    rate: float
    results: int
    missed: int
    median: float
    late: float
    latest: float


def run(seconds: float = SECONDS) -> Latency:
    """Watch the board for as many seconds."""
    about, begun = measuring_identity(CHANNELS, RATE), time.monotonic()
    with Terminal() as terminal:
        pid = os.fork()
        if not pid:
            try:
                _serve(MeasuringDevice(lambda: time.monotonic() - begun, about), terminal.end)
            finally:
                os._exit(1)
        try:
            found, missed = _watched(terminal.path, about, begun, seconds)
        finally:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
    median, late = np.quantile(found, [0.5, 0.999]).tolist()
    return Latency(BAUD, CHANNELS, RATE, len(found), missed, 1e3 * median, 1e3 * late, 1e3 * float(found.max()))


def _measured(repeats: int) -> list[Latency]:
    """Measure, undisturbed by other processes if the system grants it."""
    with suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
    return [run() for _ in range(repeats)]


def _watched(port: str, about: Identity, begun: float, seconds: float) -> tuple[npt.NDArray[np.float64], int]:
    """Record what comes; return the latencies in s, and how many samples were missed."""
    found: list[npt.NDArray[np.float64]] = []
    missed = 0
    with tempfile.TemporaryDirectory() as folder, RunRecording(Path(folder) / "run.csv", about) as recording:
        for event in watch(lambda: Board(port, baud=BAUD), _not_fed):
            if not isinstance(event, Received):
                continue
            recording.add(event)
            came = time.monotonic()
            codes = event.results.codes[:, 0]
            missed += (int(codes[0]) - event.first - missed) % _NUMBERS
            numbers = event.first + missed + np.arange(len(codes))
            found.append(np.repeat(came - begun - (numbers + 1) / about.sample_rate, CHANNELS))
            if came - begun > seconds:
                break
    return np.concatenate(found), missed


def _serve(device: MeasuringDevice, end: int) -> None:
    """Answer without an end; bytes take their time in both directions."""
    while True:
        select.select([end], [], [])
        asked = os.read(end, 1 << 12)
        time.sleep(len(asked) * _BITS / BAUD)
        answer = device.feed(asked)
        time.sleep(len(answer) * _BITS / BAUD)
        while answer:
            answer = answer[os.write(end, answer) :]


def _not_fed(identity: Identity) -> Codes:
    raise AssertionError("the board must not be fed")


def tables(rows: list[Latency]) -> str:
    """Return the table in Markdown."""
    head = "| baud | channels | Hz | results | samples missed | median, ms | 99.9 %, ms | all, ms |\n"
    return (head + "|---:" * 8 + "|\n") + "".join(
        f"| {row.baud:,} | {row.channels} | {row.rate:g} | {row.results:,} | {row.missed} "
        f"| {row.median:.1f} | {row.late:.1f} | {row.latest:.1f} |\n"
        for row in rows
    )


def section(rows: list[Latency]) -> str:
    """Return the section of the document."""
    return f"""
## How late a monitor is

From when a model of a board has measured a result to when a monitor has it in its recording, over a pseudo-terminal
whose bytes take as long as on a line of 3 Mbaud. A monitor looks 20 times a second; the rest is the line and Python.
Board and monitor run as real-time processes where the system lets them, so that what else the machine does counts
little. `python -m benchmarks.latency`, with `--check` status 1 if one in a thousand takes more than {LATEST:g} ms.

{tables(rows)}
"""


def losses(old: list[Latency], new: list[Latency]) -> list[str]:
    """Say which run was late."""
    return [
        f"all but one in a thousand results must be recorded within {LATEST:g} ms, not {row.late:.0f} ms"
        for row in new
        if row.late > LATEST
    ]


BENCHMARK = Benchmark(
    name="latency",
    row=Latency,
    measure=_measured,
    section=section,
    tables=tables,
    losses=losses,
)

if __name__ == "__main__":
    BENCHMARK.main(__doc__, repeats=1)
