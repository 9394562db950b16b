"""Everything that writes, as it is killed: what a child does, and what must be left of it."""

from __future__ import annotations

import csv
import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Protocol

import numpy as np

from sosmith import cli
from sosmith.host.board import Results
from sosmith.host.monitor import Received
from sosmith.host.outbox import Outbox
from sosmith.host.run_recording import RunRecording
from sosmith.instrument.calibration.measurement_store import open_store
from sosmith.instrument.calibration.self_updating import add, calibration_of
from sosmith.model.text_files import write_files
from sosmith.sim.build_cache import BuildCache
from sosmith.sim.exploration.record import record_in
from tests.commands.command_line import FILTER
from tests.edge.processes.forks import Ledger, forked
from tests.host.measuring import measuring_identity
from tests.instrument.calibration.measuring import readings, write_csv
from tests.suite.extras import needed

CHANNELS = 2
ABOUT = measuring_identity(CHANNELS)


class Writer(Protocol):
    """What is killed.

    Attributes
    ----------
    longest : float or None
        Seconds within which it is killed; None for as many as it takes to its end.
    """

    longest: float | None

    def prepare(self, folder: Path) -> None:
        """Put what it needs into an empty folder."""
        ...

    def write(self, folder: Path, done: Ledger) -> None:
        """Write, and note in `done` what has been acknowledged."""
        ...

    def faults(self, folder: Path, done: Ledger) -> Iterator[str]:
        """Say what is wrong with what is left after a kill, and with going on from there."""
        ...


class WritesRecording:
    """The recording of a monitor, in CSV: rows that were taken are there, and another run continues it."""

    longest = 0.06

    def prepare(self, folder: Path) -> None:
        """Nothing is there before."""

    def write(self, folder: Path, done: Ledger) -> None:
        """Record without an end."""
        with RunRecording(folder / "day.csv", ABOUT) as made:
            while True:
                made.add(_ten(done[0]))
                done[0] += 10

    def faults(self, folder: Path, done: Ledger) -> Iterator[str]:
        """Continue it, and look at the rows."""
        with RunRecording(folder / "day.csv", ABOUT) as made:
            made.add(_ten(0))
        with (folder / "day.csv").open(newline="", encoding="utf-8") as file:
            header, *rows = csv.reader(file)
        if any(len(row) != len(header) for row in rows):
            yield "a row of the recording is cut"
        run, code = header.index("run"), next(n for n, name in enumerate(header) if name.endswith("_code"))
        before, after = rows[: -10 * CHANNELS], rows[-10 * CHANNELS :]
        if [row[code] for row in before] != [str(n // CHANNELS % 256) for n in range(len(before))]:
            yield "the rows of the recording are not those that came"
        if len(before) < CHANNELS * done[0]:
            yield f"{CHANNELS * done[0]} rows were taken, {len(before)} are in the recording"
        if {row[run] for row in before} - {"1"} or {row[run] for row in after} != {"2" if before else "1"}:
            yield "the next run is not told apart"


class WritesParquet:
    """The end of a recording in Parquet: the rows are in it, or beside it."""

    longest = None

    def prepare(self, folder: Path) -> None:
        """Leave rows of a run that was killed."""
        for module in ("pyarrow.csv", "pyarrow.parquet"):  # children have them, without the threads of their use
            needed(module)
        with RunRecording(folder / "day.parquet.rows.csv", ABOUT) as made:
            for n in range(200):
                made.add(_ten(10 * n))

    def write(self, folder: Path, done: Ledger) -> None:
        """Continue it, to its end."""
        with RunRecording(folder / "day.parquet", ABOUT) as made:
            made.add(_ten(0))
            done[0] = 1
        done[0] = 2

    def faults(self, folder: Path, done: Ledger) -> Iterator[str]:
        """Complete it, in a child: threads of pyarrow must not be forked."""
        ended = forked(lambda: self._look(folder, done))
        if ended.status:
            yield ended.said.strip().rpartition("\n")[2]

    def _look(self, folder: Path, done: Ledger) -> None:
        parquet = needed("pyarrow.parquet")

        path, rows = folder / "day.parquet", 200 * 10 * CHANNELS
        whole = path.exists()
        if not whole:
            with RunRecording(path, ABOUT):
                pass
        found = parquet.read_table(path).num_rows
        assert whole or done[0] < 2, "the recording was complete, and is not there"
        wanted = rows + (10 * CHANNELS if done[0] else 0)
        assert found >= wanted, f"{wanted} rows were taken, {found} are in the recording"


class WritesOutbox:
    """Alarms on their way to a broker: those that were taken wait, those that were acknowledged do not."""

    longest = 0.08

    def prepare(self, folder: Path) -> None:
        """Nothing is there before."""

    def write(self, folder: Path, done: Ledger) -> None:
        """Put and acknowledge, in order, without an end; 0: put, 1: acknowledged, 2: begun to be acknowledged."""
        outbox, numbers = Outbox(folder / "alarms"), list[int]()
        while True:
            for _ in range(3):
                outbox.put("T/alarm", str(done[0]))
                done[0] += 1
            outbox.hand_over(lambda topic, text, retain: numbers.append(int(text)) or int(text))  # type: ignore[func-returns-value]
            for number in numbers[:2]:
                done[2] += 1
                outbox.acknowledged(number)
                done[1] += 1
            del numbers[:2]

    def faults(self, folder: Path, done: Ledger) -> Iterator[str]:
        """Look at what waits."""
        outbox, found = Outbox(folder / "alarms"), list[int]()
        while outbox.waiting:
            outbox.hand_over(lambda topic, text, retain: found.append(int(text)) or int(text))  # type: ignore[func-returns-value]
            for number in found:
                outbox.acknowledged(number)
        outbox.close()
        first, behind = (found[0], found[-1] + 1) if found else (done[0], done[0])
        if found != list(range(first, behind)):
            yield "alarms are missing, doubled or out of order"
        if not (done[1] <= first <= done[2] and done[0] <= behind <= done[0] + 1):
            yield f"alarms {done[1]} to {done[0]} must wait, not {first} to {behind}"


class WritesStore:
    """The store of measurements: each addition as a whole, with its version."""

    longest = 0.25
    _SIZE, _FILES = 12, 30

    def prepare(self, folder: Path) -> None:
        """Make files of measurements."""
        for n in range(self._FILES):
            write_csv(folder / f"{n}.csv", readings(self._SIZE, seed=n))

    def write(self, folder: Path, done: Ledger) -> None:
        """Add them, one after another."""
        with open_store(folder / "s.db", create=True) as store:
            for n in range(self._FILES):
                add(store, "left", folder / f"{n}.csv", "2026-01-01", required_r=0.5)
                done[0] = n + 1

    def faults(self, folder: Path, done: Ledger) -> Iterator[str]:
        """Look at what is in it, and add another one."""
        with open_store(folder / "s.db", create=True) as store:
            store.check()
            there = bool(store.sensors())
            versions = store.versions("left") if there else []
            if [one.measurements for one in versions] != [self._SIZE * (k + 1) for k in range(len(versions))]:
                yield "a part of an addition is in the store"
            if there and len(store.measurements("left")) != self._SIZE * len(versions):
                yield "measurements without their version are in the store"
            if len(versions) < done[0]:
                yield f"{done[0]} additions were acknowledged, {len(versions)} are in the store"
            if len(versions) < self._FILES:
                add(store, "left", folder / f"{len(versions)}.csv", "2026-01-01", required_r=0.5)
            calibration_of(store, "left")


class WritesCache:
    """The cache of compiled files: an entry is whole or made again."""

    longest = 0.06

    def prepare(self, folder: Path) -> None:
        """Nothing is there before."""

    def write(self, folder: Path, done: Ledger) -> None:
        """Make entries, damage them, and make them again."""
        cache = BuildCache(folder / "cache")
        while True:
            for n in range(4):
                with cache.entry("model", f"{n:02}", lambda place, n=n: _make_entry(place, n)) as place:  # type: ignore[misc]
                    (place / "library").write_bytes(b"")
            done[0] += 1

    def faults(self, folder: Path, done: Ledger) -> Iterator[str]:
        """Ask for all entries."""
        cache = BuildCache(folder / "cache")
        for n in range(4):
            with cache.entry("model", f"{n:02}", lambda place, n=n: _make_entry(place, n)) as place:  # type: ignore[misc]
                if (place / "library").read_bytes() != _library(n) or (place / "log").read_text() != str(n):
                    yield "an entry of the cache is not what was made"


class WritesFiles:
    """Files of any command: each is the old one or the new one."""

    longest = 0.06
    _NAMES = ("a.sv", "b.json", "c.html")

    def prepare(self, folder: Path) -> None:
        """Write them once."""
        write_files(folder / "out", self._texts(0))

    def write(self, folder: Path, done: Ledger) -> None:
        """Write them again and again."""
        while True:
            write_files(folder / "out", self._texts(done[0] + 1))
            done[0] += 1

    def faults(self, folder: Path, done: Ledger) -> Iterator[str]:
        """Look at them, and write them once more."""
        new, old = self._texts(done[0] + 1), self._texts(done[0])
        for name in self._NAMES:
            if (folder / "out" / name).read_text(encoding="utf-8") not in {old[name], new[name]}:
                yield f"{name} is neither the old file nor the new one"
        write_files(folder / "out", old)
        if any((folder / "out" / name).read_text(encoding="utf-8") != text for name, text in old.items()):
            yield "another run does not write the files"

    def _texts(self, n: int) -> dict[str, str]:
        return {name: f"{name} {n}\n" * 5000 for name in self._NAMES}


class WritesRecord:
    """The results of an exploration as they come: those on record are whole, and those that were told are there."""

    longest = 0.05

    def prepare(self, folder: Path) -> None:
        """Nothing is there before."""

    def write(self, folder: Path, done: Ledger) -> None:
        """Add results without an end."""
        with record_in(folder / "out") as record:
            while True:
                record.add({"key": str(done[0]), "changes": {"filter.order": done[0]}, "text": "ä" * 500})
                done[0] += 1

    def faults(self, folder: Path, done: Ledger) -> Iterator[str]:
        """Open it again."""
        with record_in(folder / "out") as record:
            if list(record.points) != [str(n) for n in range(len(record.points))] or len(record.points) < done[0]:
                yield f"{done[0]} results were on record, {len(record.points)} are"
            record.add({"key": "last"})
        for line in (folder / "out" / "points.jsonl").read_text(encoding="utf-8").splitlines():
            json.loads(line)


class RunsCommand:
    """A command: every file that it leaves is that of a run without a kill, and another run writes them all.

    Parameters
    ----------
    line : str
        The command, with `-o out`.
    same : tuple of str
        Names of the files whose bytes every run writes; one that ends in .jsonl grows, and a beginning of it is whole.
    """

    longest = None

    def __init__(self, line: str, *same: str) -> None:
        self._line, self._same = line, same
        self._whole: dict[str, bytes] = {}

    def prepare(self, folder: Path) -> None:
        """Write the specification."""
        (folder / "plain.toml").write_text(FILTER, encoding="utf-8")

    def write(self, folder: Path, done: Ledger) -> None:
        """Run it in a process that is one of its own."""
        os.chdir(folder)
        sys.argv = ["sosmith", *self._line.split()]
        cli.main()

    def faults(self, folder: Path, done: Ledger) -> Iterator[str]:
        """Hold what is left against a run to its end."""
        left = {name: self._read(folder, name) for name in self._same}
        ended = forked(lambda: self.write(folder, done))
        if ended.status:
            yield f"another run ends with status {ended.status}: {ended.said[-300:]}"
            return
        for name in self._same:
            self._whole.setdefault(name, self._read(folder, name) or b"")
            whole, found = self._whole[name], left[name]
            if found is not None and not (whole.startswith(found) if name.endswith(".jsonl") else whole == found):
                yield f"{name} is not whole"
            if self._read(folder, name) != self._whole[name]:
                yield f"another run writes another {name}"

    def _read(self, folder: Path, name: str) -> bytes | None:
        path = folder / "out" / name
        return path.read_bytes() if path.exists() else None


def _ten(first: int) -> Received:
    codes = np.repeat(np.arange(first, first + 10) % 256, CHANNELS).reshape(-1, CHANNELS)
    return Received(1, first, Results(codes / 8, codes, np.zeros_like(codes, np.uint8), {}), 1e9)


def _make_entry(place: Path, n: int) -> None:
    (place / "library").write_bytes(_library(n))
    (place / "log").write_text(str(n))


def _library(n: int) -> bytes:
    return bytes([n]) * 50_000


EXPLORE = "explore plain.toml -p hardware.realization=df1,delta --samples 200 --jobs 1 -o out"
SIMULATE = "simulate plain.toml --trace noise --seconds 0.05 --simulator icarus -o out"
QUICK: dict[str, Writer] = {
    "recording": WritesRecording(),
    "recording in Parquet": WritesParquet(),
    "alarms that wait": WritesOutbox(),
    "store": WritesStore(),
    "cache": WritesCache(),
    "files": WritesFiles(),
    "record of an exploration": WritesRecord(),
}
"""Writers that take hundredths of a second, by what they write."""

WHOLE: dict[str, Writer] = {
    "generate": RunsCommand("generate plain.toml -o out", "plain.sv", "plain.json", "plain.certificate.json"),
    "explore": RunsCommand(EXPLORE, "points.jsonl", "points.csv", "exploration.json"),
    "simulate": RunsCommand(SIMULATE),
}
"""Commands as a whole, which take seconds."""
