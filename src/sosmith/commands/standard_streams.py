"""Standard streams of a process: whatever of them is closed or breaks, a command does its work and has its status."""

from __future__ import annotations

import io
import os
import sys


class _Closed(io.RawIOBase):
    """Takes what is written to a stream that was closed when the process began."""

    lost = False

    def writable(self) -> bool:
        return True

    def write(self, data: object) -> int:
        taken = len(memoryview(data))  # type: ignore[arg-type]
        self.lost = self.lost or taken > 0
        return taken


class _Messages(io.FileIO):
    """Stderr: a message that cannot be told is no reason to leave work undone."""

    def write(self, data: object) -> int:
        try:
            return super().write(data)  # type: ignore[arg-type]
        except OSError:
            return len(memoryview(data))  # type: ignore[arg-type]


class StandardStreams:
    """Opens what is closed, so that no file of ours becomes a standard stream of a child; to be made once, at first."""

    def __init__(self) -> None:
        self._stdout = _Closed()
        closed = [number for number in range(3) if not _is_open(number)]
        for number in closed:
            # Opening gives the lowest number that is free, and each below is open by now.
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
            assert _is_open(number)
        if sys.stdin is None:
            sys.stdin = io.TextIOWrapper(io.FileIO(0, closefd=False), encoding="utf-8")
        if sys.stdout is None:
            sys.stdout = io.TextIOWrapper(self._stdout, encoding="utf-8", write_through=True)
        if sys.stderr is None or sys.stderr is sys.__stderr__:
            sys.stderr = io.TextIOWrapper(
                io.BufferedWriter(_Messages(2, "wb", closefd=False)),
                encoding=getattr(sys.stderr, "encoding", None) or "utf-8",
                errors="backslashreplace",
                line_buffering=True,
            )

    @property
    def lost(self) -> bool:
        """Whether something was written to a stdout that was closed from the beginning."""
        return self._stdout.lost


def _is_open(number: int) -> bool:
    try:
        os.fstat(number)
    except OSError:
        return False
    return True
