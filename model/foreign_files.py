"""The gate for files that others have made: however long or odd they are, reading takes bounded memory and ends.

Every reader of such a file takes its bytes, text, lines or JSON from here, or hands what it has to a parser of its own
that has limits. A file is a regular one: a pipe may wait for a writer for ever, a device may never end.
"""

from __future__ import annotations

import codecs
import errno
import io
import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from sosmith.model.errors import SpecificationError
from sosmith.model.file_kinds import kind_of

MAX_LINE = 1 << 16
"""Most characters of a line: that of a table with some thousand columns."""

MAX_LINES = 1 << 24
"""Most lines of a file that is read line by line: 10 million samples of a channel, or a million of each of 16."""

MAX_JSON = 1 << 26
"""Most bytes of a JSON file: a report has some hundred thousand, a large certificate some millions."""

_PIECE = 1 << 18


def opened(path: Path) -> io.BufferedReader:
    """Open a regular file to read its bytes, without waiting.

    Raises
    ------
    OSError
        If the file cannot be opened, or is a folder, a pipe, a socket or a device; its `strerror` says what it is.
    ValueError
        If `path` is an impossible one.
    """
    # Without this flag, a pipe is opened once somebody writes into it, and not before.
    number = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
    try:
        kind = kind_of(os.fstat(number).st_mode)
        if kind == "a folder":
            raise OSError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        if kind:
            raise OSError(errno.EINVAL, f"{kind}, where a regular file is needed", str(path))
        return os.fdopen(number, "rb")
    except BaseException:
        os.close(number)
        raise


def check_input(path: Path) -> None:
    """Check that `path` is neither a pipe, a socket nor a device; whether it is there is for its reader to say.

    Raises
    ------
    SpecificationError
        If it is one, itself or by links.
    """
    try:
        kind = kind_of(path.stat().st_mode)
    except (OSError, ValueError):
        return
    if kind not in {None, "a folder"}:
        raise SpecificationError(f"{path}: the input must be a regular file, not {kind}")


def read_bytes(path: Path, *, what: str, max_bytes: int) -> bytes:
    """Read a file of at most `max_bytes` bytes.

    Parameters
    ----------
    path : Path
        The file.
    what : str
        What the file is, such as "the specification", for messages.
    max_bytes : int
        Largest size of the file.

    Raises
    ------
    SpecificationError
        If the file cannot be read or is longer.
    """
    try:
        with opened(path) as file:
            content = file.read(max_bytes + 1)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise SpecificationError(f"{path}: {what} must be a readable file, not: {reason}") from None
    except ValueError:
        raise SpecificationError(f"{str(path)!r} must be the path of a file, not an impossible one") from None
    if len(content) > max_bytes:
        raise SpecificationError(f"{path}: {what} must be at most {max_bytes} bytes, not longer")
    return content


def read_text(path: Path, *, what: str, max_bytes: int) -> str:
    """Read a file of UTF-8 text as it is, with or without a byte order mark; parameters as for `read_bytes`.

    Raises
    ------
    SpecificationError
        As for `read_bytes`, or if the file is no UTF-8.
    """
    content = read_bytes(path, what=what, max_bytes=max_bytes)
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise SpecificationError(
            f"{path}: line {line} must be UTF-8 text, not the byte 0x{content[error.start]:02x}"
        ) from None


def read_json(
    path: Path,
    *,
    what: str,
    max_bytes: int = MAX_JSON,
    parse_constant: Callable[[str], Any] | None = None,
) -> Any:
    """Read a JSON file; None if it is no JSON, or one beyond the limits of Python's reader: of depth and of digits.

    Parameters
    ----------
    path, what, max_bytes
        As for `read_bytes`.
    parse_constant : callable
        Makes a value of NaN or an infinity, or raises ValueError.

    Raises
    ------
    SpecificationError
        As for `read_text`.
    """
    text = read_text(path, what=what, max_bytes=max_bytes)
    try:
        return json.loads(text, parse_constant=parse_constant)
    except (ValueError, RecursionError):
        return None


def read_lines(path: Path, *, what: str) -> Iterator[str]:
    """Yield the lines of a file of UTF-8 text as they come, with their ends, but without a byte order mark.

    Raises
    ------
    SpecificationError
        If the file cannot be read or is no UTF-8, if a line is longer than `MAX_LINE`, or if there are more than
        `MAX_LINES`.
    """
    try:
        with opened(path) as file:
            for number, line in enumerate(_lines(path, file), 1):
                if number > MAX_LINES:
                    raise SpecificationError(f"{path} must end within {MAX_LINES:,} lines, not go on")
                yield line
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise SpecificationError(f"{path} must be a readable {what} ({reason})") from None
    except ValueError:
        raise SpecificationError(f"{str(path)!r} must be the path of a file, not an impossible one") from None


def _lines(path: Path, file: io.BufferedReader) -> Iterator[str]:
    decoder = codecs.getincrementaldecoder("utf-8-sig")()
    done, rest, more = 0, "", True  # lines that were yielded, and what may go on
    while more:
        piece = file.read(_PIECE)
        more = bool(piece)
        try:
            text = rest + decoder.decode(piece, final=not more)
        except UnicodeDecodeError as error:
            at = done + rest.count("\n") + error.object.count(b"\n", 0, error.start) + 1
            raise SpecificationError(
                f"{path}, line {at}: text must be UTF-8, not contain the byte 0x{error.object[error.start]:02x}"
            ) from None
        lines = list(io.StringIO(text, newline=""))
        rest = lines.pop() if more and lines else ""
        for line in (*lines, rest):
            if len(line) > MAX_LINE:
                raise SpecificationError(
                    f"{path}, line {done + 1}: a line must have at most {MAX_LINE:,} characters, not more"
                )
            if line is not rest:
                done += 1
                yield line
