"""The recording of a monitor: rows of the runs and sessions of one board, each row with its time."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType

from sosmith.host.clock import utc_text
from sosmith.host.monitor import Received
from sosmith.host.recording import recording
from sosmith.host.rows import columns, rows
from sosmith.model.errors import SpecificationError
from sosmith.model.link.identity import Identity


class RunRecording:
    """A CSV or Parquet file with the results of one board, which another run of the monitor continues.

    Its columns are utc, time_s, run, session, channel if there are several, the result, its code, its status, and
    board, the digest of the board's identity. Runs are numbered from 1.

    Parameters
    ----------
    path : Path
        The file.
    identity : Identity
        The board.

    Raises
    ------
    SpecificationError, ToolError
        As `recording`; and if the rows in it are of another board.
    """

    def __init__(self, path: Path, identity: Identity) -> None:
        first, *rest = columns(identity)
        self._identity, self._board = identity, identity.digest
        self._rows = recording(path, ("utc", first, "run", "session", *rest, "board"))
        try:
            self._run = self._next_run(path)
        except BaseException:
            self._rows.give_back()
            raise

    def add(self, event: Received) -> None:
        """Add results; they are in the file when this returns."""
        rate = self._identity.result_rate
        self._rows.add(
            (
                utc_text(event.start + (event.first + n // self._identity.channels) / rate),
                time,
                self._run,
                event.session,
                *rest,
                self._board,
            )
            for n, (time, *rest) in enumerate(rows(self._identity, event.results, event.first))
        )

    def __enter__(self) -> RunRecording:
        """Return the recording."""
        self._rows.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Complete the file."""
        self._rows.__exit__(kind, error, trace)

    def _next_run(self, path: Path) -> int:
        """Return the number of this run, the one after that of the last row."""
        last = self._rows.last
        if last is None:
            return 1
        if last["board"] != self._board:
            raise SpecificationError(
                f"{path}: the recording must be of the board {self._board} to be continued, not of {last['board'][:12]}"
            )
        if not last["run"].isdecimal():
            raise SpecificationError(f"{path}: the run of the last row must be a number, not {last['run'][:12]}")
        return int(last["run"]) + 1
