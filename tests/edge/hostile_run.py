"""Commands at a board that lies: how they end, and whether what they took is in what they wrote."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from click.testing import Result

from sosmith.host import board, monitor
from sosmith.model.errors import SosmithError
from tests.commands.invocation import Invocation
from tests.edge.lying_board import EnoughError, LyingPort

STATUSES = {0, 1, 2, 3}
"""Those that docs and commands name, but for signals."""

TRACE = "\n".join(["x_code", *(str(n % 1024 - 512) for n in range(3000))]) + "\n"


@dataclass(frozen=True)
class Outcome:
    """How a command ended.

    Attributes
    ----------
    status : int
        Its exit status.
    messages, lies : int
        What the board said, and how much of it was no honest message.
    findings : tuple of str
        What must not be: a traceback, an unknown status, a sign that a terminal would obey, rows that are missing.
    """

    status: int
    messages: int
    lies: int
    findings: tuple[str, ...]


def hostile_run(seed: int, folder: Path) -> Outcome:
    """Let `monitor` or `stream` meet a board that lies, each in its way by the seed."""
    port = LyingPort(seed)
    record, trace = folder / f"{seed}.csv", folder / f"{seed}.trace.csv"
    trace.write_text(TRACE)
    with at(port):
        if seed % 5 == 3 and not port.measures:
            result = Invocation("stream").run("port", str(trace), "-o", str(record))
        else:
            flags = ("--alarm", "output_saturated", "--influx", "--speed", "0", "--trace", str(trace))
            result = Invocation("monitor").run("port", *flags, "-o", str(record))
    findings = tuple(_findings(result, record))
    if port.counts.strange:
        findings += ("another board was asked for results",)
    return Outcome(_status(result), port.counts.messages, port.counts.lies, findings)


@contextmanager
def at(port: LyingPort) -> Iterator[None]:
    """Let commands find the board behind every port, in its time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(board, "SerialLine", port.open)
        patch.setattr(monitor, "HostClock", lambda: port.clock)
        yield


def _status(result: Result) -> int:
    error = result.exception
    if isinstance(error, EnoughError):
        return 0
    return error.exit_status if isinstance(error, SosmithError) else result.exit_code


def _findings(result: Result, record: Path) -> Iterator[str]:
    error = result.exception
    if not (error is None or isinstance(error, SystemExit | SosmithError)):
        yield f"traceback: {error!r}"
    if _status(result) not in STATUSES:
        yield f"status {_status(result)}"
    said = f"{result.stdout}\n{result.stderr}\n{error if isinstance(error, SosmithError) else ''}"
    if not all(line.isprintable() for line in said.split("\n")):
        yield "a sign that a terminal would obey"
    if "\n" in str(error):
        yield "an error of several lines"
    if record.exists():
        yield from _wrong_rows(result, record)


def _wrong_rows(result: Result, record: Path) -> Iterator[str]:
    """Hold the recording against the lines for InfluxDB: the same results, in order."""
    with record.open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    if any(len(row) != len(header) for row in rows):
        yield "rows of another length"
    if len(set(header)) != len(header):
        yield "columns of the same name"
    if "board" not in header:  # of `stream`
        return
    run_of, utc = [(row[header.index("run")], row[header.index("session")]) for row in rows], header.index("utc")
    if any(
        one == other and earlier[utc] > later[utc]
        for one, other, earlier, later in zip(run_of, run_of[1:], rows, rows[1:], strict=False)
    ):
        yield "times of a session that go back"
    code = next(n for n, name in enumerate(header) if name.endswith("_code"))
    shown = [line.split("code=")[1].split("i")[0] for line in result.stdout.splitlines() if "code=" in line]
    if [row[code] for row in rows] != shown:
        yield f"{len(shown)} results were taken, {len(rows)} recorded"
