"""Load of a monitor: a day of a board with 12 channels, in simulated time: `python -m benchmarks.load`.

The board is a model that measures by itself; what it says is recorded, judged, kept for views, and published to a
client that acknowledges everything. What counts is that memory does not grow after the first hour. Writes
docs/speed.md.
"""

from __future__ import annotations

import os
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from benchmarks.speed_page import Benchmark
from tests.host.lines import BadLine
from tests.host.measuring import MeasuringDevice, measuring_identity

from sosmith.host.alarms import Alarms
from sosmith.host.board import Board
from sosmith.host.live_view import render
from sosmith.host.monitor import Received, watch
from sosmith.host.outbox import Outbox
from sosmith.host.page import picture
from sosmith.host.readings import Readings
from sosmith.host.run_recording import RunRecording
from sosmith.model.arrays import Codes
from sosmith.model.link.identity import Identity

CHANNELS, RATE, HOURS = 12, 1.0, 24
GROWTH = 5.0
"""Most MB by which memory may grow after the first hour."""

_TURN = 10.0  # s, of which the board keeps the results
_NUMBERS = 65_535
_VIEWS = 60  # turns between two pictures


@dataclass(frozen=True)
class Load:
    """A run.

    Attributes
    ----------
    hours : int
        Simulated hours.
    channels, rate : int, float
        Of the board; the rate in Hz for each channel.
    results, alarms : int
        What came.
    published : int
        Messages that the client was given.
    recorded : float
        Size of the recording in MB.
    seconds : float
        CPU time of the process.
    first, last : float
        Memory after the first hour and at the end, in MB.
    """

    hours: int
    channels: int
    rate: float
    results: int
    alarms: int
    published: int
    recorded: float
    seconds: float
    first: float
    last: float


class _Clock:
    """Time that passes as fast as it can, in steps that the board still bridges."""

    def __init__(self) -> None:
        self.now = 0.0

    def time(self) -> float:
        return self.now

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float, /) -> None:
        self.now += max(seconds, _TURN)


def run(hours: int = HOURS) -> Load:
    """Watch the board for as many hours."""
    clock, about = _Clock(), measuring_identity(CHANNELS, RATE)
    device = MeasuringDevice(clock.monotonic, about)
    readings = Readings(about, None, "port")
    alarms, outbox = Alarms(["fault"], about.flags, RATE), Outbox()
    begun, first, results, raised, published, turns = time.process_time(), 0.0, 0, 0, 0, 0

    def hand(topic: str, text: str, retain: bool) -> int:
        nonlocal published
        published += 1
        return (published - 1) % _NUMBERS + 1

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "day.csv"
        with RunRecording(path, about) as recording:
            for event in watch(lambda: Board.on(BadLine(device)), _not_fed, clock=clock):
                if not isinstance(event, Received):
                    continue
                turns += 1
                device.status = 0x40 if turns % 100 == 0 else 0
                recording.add(event)
                for alarm in alarms.rises(event.results, event.first, event.start):
                    raised += 1
                    readings.alarm(alarm)
                    outbox.put("T/alarm", str(alarm))
                readings.add(event.results, event.first, event.start)
                results += event.results.codes.size
                for one in readings.now:
                    outbox.show(f"T/channel/{one.channel}", str(one))
                before = published
                outbox.hand_over(hand)
                for number in range(before, published):
                    outbox.acknowledged(number % _NUMBERS + 1)
                if turns % _VIEWS == 0:
                    render(readings)
                    picture(readings, "connected")
                if not first and clock.now >= 3600:
                    first = memory()
                if clock.now >= 3600 * hours:
                    break
        size = path.stat().st_size / 1e6
    assert outbox.empty, "everything that was published must be acknowledged"
    seconds = time.process_time() - begun
    return Load(hours, CHANNELS, RATE, results, raised, published, size, seconds, first, memory())


def memory() -> float:
    """Return the memory of this process, in MB."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def _not_fed(identity: Identity) -> Codes:
    raise AssertionError("the board must not be fed")


def tables(rows: list[Load]) -> str:
    """Return the table in Markdown."""
    head = "| simulated | channels | Hz | results | alarms | publications | recording, MB | CPU, s "
    head += "| memory after an hour, MB | at the end, MB |\n" + "|---:" * 10 + "|\n"
    return head + "".join(
        f"| {row.hours} h | {row.channels} | {row.rate:g} | {row.results:,} | {row.alarms:,} | {row.published:,} "
        f"| {row.recorded:.0f} | {row.seconds:.0f} | {row.first:.1f} | {row.last:.1f} |\n"
        for row in rows
    )


def section(rows: list[Load]) -> str:
    """Return the section of the document."""
    return f"""
## A monitor over a day

A model of a board with converters, in simulated time: every result is recorded, judged and kept for views, readings of
all channels are published once in {_TURN:g} simulated seconds, and alarms as they come. Memory may grow by
{GROWTH:g} MB after the first hour. `python -m benchmarks.load`, with `--check` status 1 if it grows by more.

{tables(rows)}
"""


def losses(old: list[Load], new: list[Load]) -> list[str]:
    """Say which run needed more and more memory."""
    return [
        f"memory must grow by at most {GROWTH:g} MB after the first hour, not by {row.last - row.first:.1f} MB"
        for row in new
        if row.last - row.first > GROWTH
    ]


BENCHMARK = Benchmark(
    name="load",
    row=Load,
    measure=lambda repeats: [run() for _ in range(repeats)],
    section=section,
    tables=tables,
    losses=losses,
)

if __name__ == "__main__":
    BENCHMARK.main(__doc__, repeats=1)
