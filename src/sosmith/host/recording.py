"""Recordings of results: rows in a CSV or Parquet file, which has every row that was written even after a kill."""

from __future__ import annotations

import csv
import fcntl
import io
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Protocol

from sosmith.model.errors import SpecificationError, ToolError
from sosmith.model.file_kinds import kind_of

_JOURNAL = ".rows.csv"
"""What is added to the name of a Parquet file while it is recorded."""

_LONGEST = 1 << 20
"""Most bytes of a line that is read back."""


class Recording(Protocol):
    """Where rows go."""

    @property
    def last(self) -> dict[str, str] | None:
        """The last row that was there before, by its columns; None if there was none."""
        ...

    def add(self, rows: Iterable[Sequence[object]]) -> None:
        """Add rows, each a value for every column; they are in the file when this returns."""
        ...

    def give_back(self) -> None:
        """Leave the file as it is, for others."""
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
        If the file cannot be written, is no regular one, is written by another process, has other columns, or is a
        complete Parquet file.
    ToolError
        If Parquet is asked for, and pyarrow is missing.
    """
    return ParquetRecording(path, columns) if path.suffix.lower() == ".parquet" else CsvRecording(path, columns)


def check_output(path: Path, *inputs: Path | None) -> None:
    """Check that a file may be written: that it is a regular one or none yet, and none of the inputs.

    Raises
    ------
    SpecificationError
        If it may not.
    """
    if path.exists() and not path.is_file():
        raise SpecificationError(f"{path}: the output must be a regular file, not {kind_of(path.stat().st_mode)}")
    for given in inputs:
        if given is not None and path.exists() and given.exists() and path.samefile(given):
            raise SpecificationError(f"{path}: the output must be another file than the input {given}, not the same")


class CsvRecording:
    """Rows in a CSV file; one that exists is continued.

    A row that a kill or a crash has cut short at the end of the file is removed. Rows are handed to the system at
    once, so that a kill of this process loses none. While it is recorded, no other process may do so.

    Parameters
    ----------
    path : Path
        The file.
    columns : sequence of str
        Names of the columns.

    Attributes
    ----------
    last : dict of str to str, or None
        The last row that was there before.

    Raises
    ------
    SpecificationError
        If the file cannot be written, is no regular one, is written by another process, or has other columns.
    """

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        self._path, header = path, as_csv([columns]).encode()
        try:
            # Without waiting: a FIFO would block until somebody reads it.
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NONBLOCK, 0o666)
        except OSError as error:
            raise SpecificationError(
                f"{path}: the recording must be a file that can be written, not: {error.strerror}"
            ) from None
        try:
            self._take()
            with os.fdopen(os.dup(self._file), "rb") as reader:
                first = reader.readline(_LONGEST)
                if first not in {b"", header} and not header.startswith(first):
                    shown = first.decode(errors="replace").rstrip("\n")[:200]
                    raise SpecificationError(
                        f"{path}: the columns must be {header.decode().rstrip()} to be continued, not {shown}"
                    )
            complete = _complete_lines(path)
            os.ftruncate(self._file, complete)
            os.lseek(self._file, 0, os.SEEK_END)
            self.last = self._last_row(columns, complete)
            if not complete:
                self._write(header)
        except BaseException:
            os.close(self._file)
            raise

    def add(self, rows: Iterable[Sequence[object]]) -> None:
        """Add rows, each a value for every column."""
        self._write(as_csv(rows).encode())

    def give_back(self) -> None:
        """Close the file."""
        os.close(self._file)

    def __enter__(self) -> CsvRecording:
        """Return the recording."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file."""
        self.give_back()

    def _take(self) -> None:
        """Check that the file is a regular one, and lock it."""
        if kind := kind_of(os.fstat(self._file).st_mode):
            raise SpecificationError(f"{self._path}: the recording must be a regular file, not {kind}")
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            reason = "written by another process" if isinstance(error, BlockingIOError) else error.strerror
            raise SpecificationError(
                f"{self._path}: the recording must be a file that nobody else writes, not: {reason}"
            ) from None

    def _last_row(self, columns: Sequence[str], size: int) -> dict[str, str] | None:
        """Read the last complete row."""
        start = max(size - _LONGEST, 0)
        *_, before, last = b"", b"", *os.pread(self._file, size - start, start).splitlines()
        if not before:  # the last line is the header, or there is none
            return None
        values = next(csv.reader([last.decode(errors="replace")]), [])
        if len(values) != len(columns):
            raise SpecificationError(
                f"{self._path}: the last row must have {len(columns)} values to be continued, not {len(values)}"
            )
        return dict(zip(columns, values, strict=True))

    def _write(self, data: bytes) -> None:
        while data:
            try:
                data = data[os.write(self._file, data) :]
            except OSError as error:
                raise ToolError(f"{self._path}: the disk must take the recording, not: {error.strerror}") from None


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

    @property
    def last(self) -> dict[str, str] | None:
        """The last row that a kill has left."""
        return self._rows.last

    def add(self, rows: Iterable[Sequence[object]]) -> None:
        """Add rows, each a value for every column."""
        self._rows.add(rows)

    def give_back(self) -> None:
        """Leave the rows beside the file."""
        self._rows.give_back()

    def __enter__(self) -> ParquetRecording:
        """Return the recording."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write the Parquet file, and remove the rows beside it."""
        try:
            self._convert()
        except OSError as failure:
            raise ToolError(
                f"{self._path}: the disk must take the recording, not: {failure.strerror or failure}; "
                f"its rows are in {self._journal}"
            ) from None
        except ValueError as failure:  # as pyarrow's own, by rows that somebody else has changed
            reason = str(failure).splitlines()[0]
            raise ToolError(
                f"{self._path}: the rows in {self._journal} must be those that were recorded, not: {reason}"
            ) from None
        finally:
            self._rows.give_back()

    def _convert(self) -> None:
        import pyarrow
        from pyarrow import csv as arrow
        from pyarrow import parquet

        # What the first rows look like must not decide: a digest may look like a number, and a clock may be set far.
        types = {"utc": pyarrow.timestamp("us", "UTC"), "board": pyarrow.string()}
        options = arrow.ConvertOptions(column_types=types)
        unfinished = self._path.with_name(self._path.name + ".part")
        unfinished.unlink(missing_ok=True)  # of a kill; a link or a pipe there would be followed or waited for
        with (
            unfinished.open("xb") as file,
            arrow.open_csv(self._journal, convert_options=options) as batches,
            parquet.ParquetWriter(file, batches.schema) as writer,
        ):
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
            newline = file.read(end - start).rfind(b"\n")
            if newline >= 0:
                return start + newline + 1
            end = start
    return 0


def as_csv(rows: Iterable[Sequence[object]]) -> str:
    """Return rows as CSV; floats have the digits that give them back."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
