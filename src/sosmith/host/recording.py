"""Recordings of results: rows in a CSV or Parquet file, which has every row that was written even after a kill."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Protocol

from sosmith.model.errors import SpecificationError, ToolError

_JOURNAL = ".rows.csv"
"""What is added to the name of a Parquet file while it is recorded."""


class Recording(Protocol):
    """Where rows go."""

    def add(self, rows: Iterable[Sequence[object]]) -> None:
        """Add rows, each a value for every column; they are in the file when this returns."""
        ...

    def __enter__(self) -> Recording:
        """Return the recording."""
        ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Complete the file."""
        ...


def recording(path: Path, columns: Sequence[str]) -> Recording:
    """Return the recording for a file: Parquet if its name ends in .parquet, else CSV.

    Raises
    ------
    SpecificationError
        If the file cannot be written, has other columns, or is a complete Parquet file.
    ToolError
        If Parquet is asked for, and pyarrow is missing.
    """
    return ParquetRecording(path, columns) if path.suffix.lower() == ".parquet" else CsvRecording(path, columns)


class CsvRecording:
    """Rows in a CSV file; one that exists is continued.

    A row that a kill or a crash has cut short at the end of the file is removed. Rows are handed to the system at
    once, so that a kill of this process loses none.

    Parameters
    ----------
    path : Path
        The file.
    columns : sequence of str
        Names of the columns.

    Raises
    ------
    SpecificationError
        If the file cannot be written or has other columns.
    """

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        header = ",".join(columns).encode()
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as error:
            raise SpecificationError(
                f"{path}: the recording must be a file that can be written, not: {error.strerror}"
            ) from None
        try:
            with os.fdopen(os.dup(self._file), "rb") as reader:
                first = reader.readline().rstrip(b"\n")
                if first not in {b"", header} and not header.startswith(first):
                    shown = first.decode(errors="replace")[:200]
                    raise SpecificationError(
                        f"{path}: the columns must be {header.decode()} to be continued, not {shown}"
                    )
            complete = _complete_lines(path)
            os.ftruncate(self._file, complete)
            os.lseek(self._file, 0, os.SEEK_END)
            if not complete:
                self._write(header + b"\n")
        except BaseException:
            os.close(self._file)
            raise

    def add(self, rows: Iterable[Sequence[object]]) -> None:
        """Add rows, each a value for every column."""
        self._write("".join(",".join(map(_text, row)) + "\n" for row in rows).encode())

    def __enter__(self) -> CsvRecording:
        """Return the recording."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file."""
        os.close(self._file)

    def _write(self, data: bytes) -> None:
        while data:
            try:
                data = data[os.write(self._file, data) :]
            except OSError as error:
                raise ToolError(f"the disk must take the recording, not: {error.strerror}") from None


class ParquetRecording:
    """Rows in a Parquet file, which is written at the end; until then they are in a CSV file beside it.

    A CSV file that a kill has left is continued. Its name is that of the Parquet file with `.rows.csv` behind.
    """

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        try:
            import pyarrow.parquet  # noqa: F401
        except ImportError:
            raise ToolError("pyarrow must be installed for Parquet: pip install 'sosmith[parquet]'") from None
        if path.exists():
            raise SpecificationError(f"{path}: the recording must be a new file, not one that is complete")
        self._path, self._journal = path, path.with_name(path.name + _JOURNAL)
        self._rows = CsvRecording(self._journal, columns)

    def add(self, rows: Iterable[Sequence[object]]) -> None:
        """Add rows, each a value for every column."""
        self._rows.add(rows)

    def __enter__(self) -> ParquetRecording:
        """Return the recording."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write the Parquet file, and remove the rows beside it."""
        from pyarrow import csv, parquet

        self._rows.__exit__(kind, error, trace)
        unfinished = self._path.with_name(self._path.name + ".part")
        with csv.open_csv(self._journal) as batches, parquet.ParquetWriter(unfinished, batches.schema) as writer:
            for batch in batches:
                writer.write_batch(batch)
        unfinished.replace(self._path)
        self._journal.unlink()


def _complete_lines(path: Path) -> int:
    """Count the bytes of a file up to its last line's end."""
    size = path.stat().st_size
    with path.open("rb") as file:
        end = size
        while end:
            start = max(end - 4096, 0)
            file.seek(start)
            found = file.read(end - start).rfind(b"\n")
            if found >= 0:
                return start + found + 1
            end = start
    return 0


def _text(value: object) -> str:
    return repr(value) if isinstance(value, float) else str(value)
