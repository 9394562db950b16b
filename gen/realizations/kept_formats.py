"""Trimmed formats that are kept from one command to the next, in the user's cache folder.

A file is named by a digest of all that the search depends on: its rows, input stages, objective, start and the allowed
error, the sources of the search, and the version of numpy. What is read is a proposal like that of the search itself:
the proof decides whether a design may have it. A file that is not as it was written, or a folder that cannot be used,
is as none.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from sosmith.gen.realizations.section_format import SectionFormat


@dataclass(frozen=True)
class Choice:
    """Index of the input stage, and the formats of every section that can be chosen."""

    input_stage: int
    formats: tuple[SectionFormat, ...]

    def with_format(self, k: int, form: SectionFormat) -> Choice:
        """Return a copy with another format of section k."""
        return Choice(self.input_stage, (*self.formats[:k], form, *self.formats[k + 1 :]))


LIMIT = 4096
"""Files that are kept; beyond, the older half of them goes."""

_SOURCES = ("gen/word_lengths", "gen/realizations", "gen/proof", "model/dataflow", "model/sections", "model/arithmetic")
"""What decides on the result, from the folder that holds the rooms."""


def kept_or_made(start: Choice, key: tuple[object, ...], make: Callable[[], Choice]) -> Choice:
    """Return the result for a key that is kept, or make it and keep that.

    Parameters
    ----------
    start : Choice
        What the search begins with, and what is the same of every result: which coefficients and quantizers there are.
    key : tuple
        What it depends on besides; equal keys have equal representations.
    make : callable
        The search.
    """
    text = repr((start, key))
    folder = None if " object at 0x" in text else cache_folder()
    if folder is None:
        return make()
    place = folder / f"{hashlib.sha256(f'{_sources()} {text}'.encode()).hexdigest()}.json"
    known = _read(place, start)
    if known is None:
        known = make()
        _write(place, known)
    return known


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


def _read(place: Path, start: Choice) -> Choice | None:
    """Return what is kept; None if it is nothing that the search could have come to."""
    try:
        tree = json.loads(place.read_text(encoding="utf-8"))
        formats = tuple(
            SectionFormat(coefficients=_pairs(part["coefficients"]), fracs=_numbers(part["fracs"]))
            for part in tree["formats"]
        )
        choice = Choice(_number(tree["input_stage"]), formats)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None
    alike = len(formats) == len(start.formats) and all(
        set(mine.coefficients) == set(theirs.coefficients) and set(theirs.fracs) <= set(mine.fracs)
        for mine, theirs in zip(formats, start.formats, strict=True)
    )
    return choice if alike and choice.input_stage >= start.input_stage else None


def _number(value: object) -> int:
    if type(value) is not int:
        raise TypeError("a kept format must be a whole number")
    return value


def _numbers(tree: Mapping[str, object]) -> dict[str, int]:
    return {name: _number(value) for name, value in tree.items()}


def _pairs(tree: Mapping[str, list[object]]) -> dict[str, tuple[int, int]]:
    return {name: (_number(integer), _number(frac)) for name, (integer, frac) in tree.items()}


def _write(place: Path, choice: Choice) -> None:
    formats = [{"coefficients": dict(each.coefficients), "fracs": dict(each.fracs)} for each in choice.formats]
    text = json.dumps({"input_stage": choice.input_stage, "formats": formats})
    new = place.with_suffix(f".{os.getpid()}.new")
    try:
        new.write_text(text, encoding="utf-8")
        new.replace(place)
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
