"""The results of an exploration on disk: one line each, appended as they come, so that a killed run can go on."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sosmith.model.errors import SpecificationError, ToolError
from sosmith.model.foreign_files import read_bytes
from sosmith.model.text_files import write_files
from sosmith.sim.exploration.evaluation import Point

FILE = "points.jsonl"

LARGEST = 1 << 28
"""Most bytes of the file: a result has some thousand."""


class Record:
    """Results by the key of their task, in a file that one process at a time writes.

    A line that a killed process has left unfinished is cut off. Results of other tasks, of another grid or an earlier
    version, stay and do no harm.
    """

    def __init__(self, handle: int, path: Path) -> None:
        self._handle, self._path = handle, path
        self.points: dict[str, Point] = {}
        whole = 0
        content = read_bytes(path, what="the record", max_bytes=LARGEST)
        for line in content.splitlines(keepends=True):
            try:
                point = json.loads(line)
                self.points[point["key"]] = point
            except (ValueError, TypeError, KeyError):
                break
            if not line.endswith(b"\n"):
                break
            whole += len(line)
        if whole < len(content):
            self.points = {}
            for line in content[:whole].splitlines():
                point = json.loads(line)
                self.points[point["key"]] = point
            os.truncate(path, whole)

    def add(self, point: Point) -> None:
        """Append a result; one that is there already is not written again.

        Raises
        ------
        ToolError
            If the disk is full, or fails.
        """
        if point["key"] in self.points:
            return
        self.points[point["key"]] = point
        line = json.dumps(point, ensure_ascii=False, allow_nan=False).encode() + b"\n"
        try:
            if os.write(self._handle, line) != len(line):
                raise ToolError(f"{self._path}: the disk must take the results, not: it is full")
        except OSError as error:
            raise ToolError(f"{self._path}: the disk must take the results, not: {error.strerror}") from None


@contextmanager
def record_in(folder: Path) -> Iterator[Record]:
    """Open the record in `folder`, made if missing, for this process alone.

    Raises
    ------
    SpecificationError
        If the folder cannot be written, or another run uses it.
    """
    write_files(folder, {})
    path = folder / FILE
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
    except OSError as error:
        raise SpecificationError(
            f"{folder}: the output folder must be a folder that can be written, not: {error.strerror}"
        ) from None
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise SpecificationError(
                f"{folder}: the output folder must be free, not in use by another run; choose one with -o"
            ) from None
        yield Record(handle, path)
    finally:
        os.close(handle)
