"""Standard streams of a process: whatever of them is closed or breaks, a command does its work and has its status."""

from __future__ import annotations

import io
import os
import sys
from typing import TYPE_CHECKING

from sosmith.model.errors import ToolError

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer


class _Closed(io.RawIOBase):
    """Takes what is written to a stream that was closed when the process began."""

    lost: str | None = None

    def writable(self) -> bool:
        return True

    def write(self, data: ReadableBuffer) -> int:
        taken = len(memoryview(data))
        if taken:
            self.lost = "stdout must be open, not closed: what was printed is lost"
        return taken


class _Results(io.FileIO):
    """Stdout: what it does not take is reported at the end, when all files are written."""

    lost: str | None = None

    def write(self, data: ReadableBuffer) -> int:
        try:
            return super().write(data)
        except BrokenPipeError:  # the reader has left, and wants no more
            raise
        except OSError as error:
            self.lost = f"stdout must take what is printed, not: {error.strerror}"
            return len(memoryview(data))


class _Messages(io.FileIO):
    """Stderr: a message that cannot be written is no reason to leave work undone."""

    def write(self, data: ReadableBuffer) -> int:
        try:
            return super().write(data)
        except OSError:
            return len(memoryview(data))


class StandardStreams:
    """Opens what is closed, so that no file of ours becomes a standard stream of a child; created once, at first."""

    def __init__(self) -> None:
        self._stdout: _Closed | _Results = _Closed()
        closed = [number for number in range(3) if not _is_open(number)]
        for number in closed:
            # Opening gives the lowest number that is free, and each below is open by now.
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
            assert _is_open(number)
        if sys.stdin is None:
            sys.stdin = io.TextIOWrapper(io.FileIO(0, closefd=False), encoding="utf-8")
        if sys.stdout is None:
            sys.stdout = io.TextIOWrapper(self._stdout, encoding="utf-8", write_through=True)
        elif isinstance(sys.stdout, io.TextIOWrapper) and sys.stdout is sys.__stdout__:
            self._stdout = _Results(1, "wb", closefd=False)
            sys.stdout = io.TextIOWrapper(
                io.BufferedWriter(self._stdout),
                encoding=sys.stdout.encoding,
                errors=sys.stdout.errors,
                line_buffering=sys.stdout.line_buffering,
                write_through=sys.stdout.write_through,
            )
        if sys.stderr is None or sys.stderr is sys.__stderr__:
            sys.stderr = io.TextIOWrapper(
                io.BufferedWriter(_Messages(2, "wb", closefd=False)),
                encoding=getattr(sys.stderr, "encoding", None) or "utf-8",
                errors="backslashreplace",
                line_buffering=True,
            )

    @property
    def lost(self) -> str | None:
        """Why something that was printed is lost, a sentence; None if nothing is."""
        return self._stdout.lost


def check_stdout() -> None:
    """Check that stdout has taken what was printed, for commands that print without an end.

    Raises
    ------
    ToolError
        If something is lost.
    """
    lost = getattr(getattr(getattr(sys.stdout, "buffer", None), "raw", None), "lost", None)
    if lost is not None:
        raise ToolError(lost)


def _is_open(number: int) -> bool:
    try:
        os.fstat(number)
    except OSError:
        return False
    return True
