"""Writes files so that an interruption leaves each of them old or new, never half."""

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
    """Write bytes as `write_files` does texts."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        # Files in a scratch folder get the permissions that the user's umask gives any new file.
        with tempfile.TemporaryDirectory(prefix=".sosmith-", dir=directory) as scratch:
            for name, content in contents.items():
                (Path(scratch) / name).write_bytes(content)
            for name in contents:
                if (directory / name).is_dir():
                    raise SpecificationError(f"{directory / name}: the output file must be a file, not a folder")
            return [(Path(scratch) / name).replace(directory / name) for name in contents]
    except OSError as error:
        raise SpecificationError(
            f"{directory}: the output folder must be a folder that can be written, not: {error.strerror}"
        ) from None


def to_json(tree: Any) -> str:
    """JSON text with a stable layout; refuses NaN and infinities."""
    return json.dumps(tree, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
