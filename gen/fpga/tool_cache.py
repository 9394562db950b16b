"""Where the programs of Amaranth and YoWASP keep what they compile of themselves: without such a folder they fail."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

_PARTS = ("wasmtime", "YoWASP")


def tool_cache() -> dict[str, str]:
    """Variables of the environment that these programs need beside this process's.

    There are none if the user's cache folder can be written; else a folder of our own takes its place, which lasts as
    long as this process. It is their home, too, where the user's has no absolute path, which they refuse.
    """
    home = {} if Path(os.environ.get("HOME", "/")).is_absolute() else {"HOME": _own().name}
    return home | _cache_folder()


def _cache_folder() -> dict[str, str]:
    named = os.environ.get("XDG_CACHE_HOME", "")
    try:
        folder = Path(named) if Path(named).is_absolute() else Path.home() / ".cache"
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # no home, or not writable
        return {"XDG_CACHE_HOME": _own().name}
    places = (folder, *(folder / part for part in _PARTS if (folder / part).exists()))
    if all(os.access(place, os.W_OK | os.X_OK) for place in places):
        return {}
    return {"XDG_CACHE_HOME": _own().name}


@cache
def _own() -> TemporaryDirectory[str]:
    """Make the folder; it is deleted when this process ends."""
    return TemporaryDirectory(prefix="sosmith-")
