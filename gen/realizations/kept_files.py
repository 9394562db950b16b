"""What is made once and kept from one command to the next, in files of the user's cache folder.

A file is named by a digest of all that its content depends on. One that is not as it was written, or a folder that
cannot be used, is as none.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from functools import cache
from itertools import count
from pathlib import Path
from typing import Any

_LOOKS = 64
"""Of the files that are written, each of so many is a reason to count them."""

_written = count()


def folder_in_cache(name: str) -> Path | None:
    """Return a folder for files of one kind in the user's cache folder, made if missing; None if it cannot be made."""
    named = os.environ.get("XDG_CACHE_HOME", "")
    try:
        folder = (Path(named) if Path(named).is_absolute() else Path.home() / ".cache") / "sosmith" / name
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # no home, or not writable
        return None
    return folder


@cache
def digest_of_sources(parts: tuple[str, ...], *versions: str) -> str:
    """Return a digest of the sources in some folders, named from the one that holds the rooms, and of versions."""
    digest = hashlib.sha256(" ".join(versions).encode())
    room = Path(__file__).resolve().parents[2]
    for path in sorted(path for part in parts for path in (room / part).glob("**/*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def read_kept(place: Path) -> list[Any] | None:
    """Return what a file holds, as the only element of a list; None if there is none as it was written."""
    try:
        digest, text = place.read_text(encoding="utf-8").split("\n")
        if digest != hashlib.sha256(text.encode()).hexdigest():
            return None
        return [json.loads(text)]
    except (OSError, ValueError):
        return None


def keep(place: Path, tree: Any, limit: int) -> None:
    """Write a file, with what JSON can hold; now and then, remove the older half where there are more than `limit`."""
    text = json.dumps(tree)
    new = place.with_suffix(f".{os.getpid()}.new")
    try:
        new.write_text(f"{hashlib.sha256(text.encode()).hexdigest()}\n{text}", encoding="utf-8")
        new.replace(place)
        if next(_written) % _LOOKS == 0:
            _shrink(place.parent, limit)
    except OSError:  # a full disk, or a folder that has gone: the next command makes it again
        with contextlib.suppress(OSError):
            new.unlink(missing_ok=True)


def _shrink(folder: Path, limit: int) -> None:
    """Remove the older half where there are too many."""
    places = list(folder.iterdir())
    if len(places) > limit:
        for place in sorted(places, key=lambda each: each.stat().st_mtime_ns)[: len(places) // 2]:
            place.unlink(missing_ok=True)
