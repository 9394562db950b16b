"""Writes files so that an interruption leaves each of them old or new, never half; devices and pipes as they come."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sosmith.model.errors import SpecificationError


def write_files(directory: Path, texts: Mapping[str, str]) -> list[Path]:
    """Write `texts` (by file name) into `directory`, made if missing: all prepared first, then moved into place.

    Returns
    -------
    list of Path
        The files, in the order of `texts`.

    Raises
    ------
    SpecificationError
        If the folder cannot be made or written, or a file's name is taken by a folder; nothing is written then.
    """
    return write_contents(directory, {name: text.encode() for name, text in texts.items()})


def write_contents(directory: Path, contents: Mapping[str, bytes]) -> list[Path]:
    """Write bytes as `write_files` does texts.

    Only regular files are replaced: a link is followed, and a device or a pipe is written to.
    """
    paths = [directory / name for name in contents]
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for path in paths:
            if path.is_dir():
                raise SpecificationError(f"{path}: the output file must be a file, not a folder")
        own = {path.name for path in paths if not path.is_symlink() and (path.is_file() or not path.exists())}
        if own:
            # Files in a scratch folder get the permissions that the user's umask gives any new file.
            with tempfile.TemporaryDirectory(prefix=".sosmith-", dir=directory) as scratch:
                for name in own:
                    (Path(scratch) / name).write_bytes(contents[name])
                for name in own:
                    (Path(scratch) / name).replace(directory / name)
        for path in paths:
            target = path.resolve()
            if path.is_symlink() and (target.is_file() or not target.exists()):
                write_contents(target.parent, {target.name: contents[path.name]})
            elif path.name not in own:
                path.write_bytes(contents[path.name])
    except OSError as error:
        raise SpecificationError(
            f"{directory}: the output folder must be a folder that can be written, not: {error.strerror}"
        ) from None
    return paths


def to_json(tree: Any) -> str:
    """JSON text with a stable layout; refuses NaN and infinities."""
    return json.dumps(tree, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
