"""Atomic file writing: after an interruption each file has its old or its new content."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from sosmith.model.errors import SosmithError, SpecificationError, ToolError
from sosmith.model.file_kinds import kind_of

_UNUSABLE = {
    errno.EACCES,
    errno.EEXIST,
    errno.EISDIR,
    errno.ELOOP,
    errno.ENAMETOOLONG,
    errno.ENOENT,
    errno.ENOTDIR,
    errno.EPERM,
    errno.EROFS,
}
"""Errors that tell of the place that the user has named: another one helps. All others tell of the disk."""

_PREFIX = ".sosmith-"
"""How the names of scratch folders begin."""

_STALE = 60.0
"""Seconds after which a scratch folder that nobody holds is what a kill has left; it is not held at once."""


def write_files(directory: Path, texts: Mapping[str, str]) -> list[Path]:
    """Write `texts`, keyed by file name, into `directory`: write all to a scratch folder, then move them into place.

    The directory is created if it does not exist.

    Returns
    -------
    list of Path
        Paths of the files, in the order of `texts`.

    Raises
    ------
    SpecificationError
        If the directory cannot be created or written, or a folder has the name of a file. Nothing is written then.
    ToolError
        If the disk is full, or fails.
    """
    return write_contents(directory, {name: text.encode() for name, text in texts.items()})


def write_contents(directory: Path, contents: Mapping[str, bytes | Iterable[str]]) -> list[Path]:
    """Write `contents`, each bytes or the pieces of a text, as `write_files` writes texts.

    Only regular files are replaced, and links to them followed: see `check_file`.
    """
    paths = [directory / name for name in contents]
    missing: list[Path] = []
    try:
        missing += [folder for folder in (directory, *directory.parents) if not folder.exists()]
        directory.mkdir(parents=True, exist_ok=True)
        for path in paths:
            check_file(path)
        own = {path.name for path in paths if not path.is_symlink()}
        if own:
            with _scratch(directory) as scratch:
                for name in own:
                    _write(scratch / name, contents[name])
                for name in own:
                    (scratch / name).replace(directory / name)
        for path in paths:
            if path.is_symlink():
                target = path.resolve()
                write_contents(target.parent, {target.name: contents[path.name]})
    except OSError as error:
        for folder in missing:
            with suppress(OSError):  # it was not made, or has been filled
                folder.rmdir()
        raise _failure(directory, error) from None
    return paths


@contextmanager
def _scratch(directory: Path) -> Iterator[Path]:
    """Make a folder in `directory` that goes in the end, and hold it; remove those that kills have left.

    Unlike a file of tempfile.mkstemp, one that is created in it has the permissions of the user's umask.
    """
    import tempfile  # only writing needs it

    for place in directory.glob(f"{_PREFIX}*"):
        with suppress(OSError):
            _remove_left(place)
    with tempfile.TemporaryDirectory(prefix=_PREFIX, dir=directory) as scratch:
        descriptor = os.open(scratch, os.O_RDONLY)
        try:
            with suppress(OSError):  # a file system without locks
                fcntl.flock(descriptor, fcntl.LOCK_SH)
            yield Path(scratch)
        finally:
            os.close(descriptor)


def _remove_left(place: Path) -> None:
    import shutil

    descriptor = os.open(place, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if time.time() - os.fstat(descriptor).st_mtime > _STALE:
            shutil.rmtree(place)
    finally:
        os.close(descriptor)


def write_pieces(path: Path, pieces: Iterable[str]) -> None:
    """Write a text as `write_files` does, piece by piece, so that it need not be in memory as a whole."""
    write_contents(path.parent, {path.name: pieces})


def _write(path: Path, content: bytes | Iterable[str]) -> None:
    if isinstance(content, bytes):
        path.write_bytes(content)
        return
    with path.open("w", encoding="utf-8", newline="") as file:
        file.writelines(content)


def write_file(path: Path, content: str | bytes) -> Path:
    """Write one file as `write_files` does; return `path`."""
    write_contents(path.parent, {path.name: content.encode() if isinstance(content, str) else content})
    return path


def check_file(path: Path) -> None:
    """Check that `path` is a regular file, or none yet.

    Replacing a device or a pipe would take it from others, and writing into it may wait for ever or lose the content.

    Raises
    ------
    SpecificationError
        If it is a folder, a device, a pipe or a socket, itself or by links; or if its name is impossible.
    """
    try:
        mode = path.stat().st_mode
    except OSError as error:
        if error.errno in {errno.ENOENT, errno.ENOTDIR}:
            return  # who makes the folders tells what is wrong with them
        raise SpecificationError(
            f"{path}: the output file must be a file that can be written, not: {error.strerror}"
        ) from None
    except ValueError:
        raise SpecificationError(f"{str(path)!r} must be the path of a file, not an impossible one") from None
    if kind := kind_of(mode):
        raise SpecificationError(f"{path}: the output file must be a file, not {kind}")


def _failure(directory: Path, error: OSError) -> SosmithError:
    if error.errno in _UNUSABLE:
        return SpecificationError(
            f"{directory}: the output folder must be a folder that can be written, not: {error.strerror}"
        )
    return ToolError(f"{directory}: the disk must take the output files, not: {error.strerror}")


def to_json(tree: Any) -> str:
    """Return `tree` as JSON text with a fixed layout; raises ValueError for NaN and infinities."""
    return json.dumps(tree, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
