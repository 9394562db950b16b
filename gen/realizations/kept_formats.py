"""What the search for formats comes to, kept from one command to the next in the user's cache folder.

A file is named by a digest of all that its content depends on: rows, input stages, objective and the allowed error, the
sources of the search, and the version of numpy. What is read is a proposal like that of the search itself: the proof
decides whether a design may have it. A file that is not as it was written, or a folder that cannot be used, is as none.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import count
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from sosmith.gen.realizations.section_format import SectionFormat

_Kept = TypeVar("_Kept")


@dataclass(frozen=True)
class Choice:
    """Index of the input stage, and the formats of every section that can be chosen."""

    input_stage: int
    formats: tuple[SectionFormat, ...]

    def with_format(self, k: int, form: SectionFormat) -> Choice:
        """Return a copy with another format of section k."""
        return Choice(self.input_stage, (*self.formats[:k], form, *self.formats[k + 1 :]))


LIMIT = 16384
"""Files that are kept; beyond, the older half of them goes."""

_LOOKS = 64
"""Of the files that are written, each of so many is a reason to count them."""

_SOURCES = (
    *("gen/architectures", "gen/filter", "gen/fpga", "gen/proof", "gen/realizations", "gen/word_lengths", "hdl/plan"),
    *("model/arithmetic", "model/dataflow", "model/sections"),
)
"""What decides on the result, from the folder that holds the rooms."""

_written = count()


def kept_or_made(
    key: tuple[object, ...], make: Callable[[], _Kept], to_tree: Callable[[_Kept], Any], of_tree: Callable[[Any], _Kept]
) -> _Kept:
    """Return the result for a key that is kept, or make it and keep that.

    Parameters
    ----------
    key : tuple
        What it is, and all that it depends on; equal keys have equal representations.
    make : callable
        The search.
    to_tree, of_tree : callable
        Convert a result to what JSON can hold, and back.
    """
    text = repr(key)
    folder = None if " object at 0x" in text else cache_folder()
    if folder is None:
        return make()
    place = folder / f"{hashlib.sha256(f'{_sources()} {text}'.encode()).hexdigest()}.json"
    tree = _read(place)
    if tree is not None:
        return of_tree(tree[0])
    result = make()
    _write(place, to_tree(result))
    return result


def tree_of_choice(choice: Choice) -> dict[str, Any]:
    """Return a choice as `choice_of_tree` takes it."""
    formats = [{"coefficients": dict(each.coefficients), "fracs": dict(each.fracs)} for each in choice.formats]
    return {"input_stage": choice.input_stage, "formats": formats}


def choice_of_tree(tree: dict[str, Any]) -> Choice:
    """Return the choice that `tree_of_choice` had."""
    formats = tuple(
        SectionFormat(
            coefficients={name: (integer, frac) for name, (integer, frac) in part["coefficients"].items()},
            fracs=part["fracs"],
        )
        for part in tree["formats"]
    )
    return Choice(tree["input_stage"], formats)


def cache_folder() -> Path | None:
    named = os.environ.get("XDG_CACHE_HOME", "")
    try:
        folder = (Path(named) if Path(named).is_absolute() else Path.home() / ".cache") / "sosmith" / "trimmed"
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # no home, or not writable
        return None
    return folder


@cache
def _sources() -> str:
    """Return a digest of the sources, and of what computes the responses."""
    digest = hashlib.sha256(np.__version__.encode())
    room = Path(__file__).resolve().parents[2]
    for path in sorted(path for part in _SOURCES for path in (room / part).glob("**/*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _read(place: Path) -> list[Any] | None:
    """Return what is kept, as the only element of a list; None if it is not as it was written."""
    try:
        digest, text = place.read_text(encoding="utf-8").split("\n")
        if digest != hashlib.sha256(text.encode()).hexdigest():
            return None
        return [json.loads(text)]
    except (OSError, ValueError):
        return None


def _write(place: Path, tree: Any) -> None:
    text = json.dumps(tree)
    new = place.with_suffix(f".{os.getpid()}.new")
    try:
        new.write_text(f"{hashlib.sha256(text.encode()).hexdigest()}\n{text}", encoding="utf-8")
        new.replace(place)
        if next(_written) % _LOOKS == 0:
            _shrink(place.parent)
    except OSError:  # a full disk, or a folder that has gone: the next command searches again
        with contextlib.suppress(OSError):
            new.unlink(missing_ok=True)


def _shrink(folder: Path) -> None:
    """Remove the older half where there are too many."""
    places = list(folder.iterdir())
    if len(places) > LIMIT:
        for place in sorted(places, key=lambda each: each.stat().st_mtime_ns)[: len(places) // 2]:
            place.unlink(missing_ok=True)
