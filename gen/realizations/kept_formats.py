"""What the search for formats comes to, kept from one command to the next in the user's cache folder.

A file is named by a digest of all that its content depends on: rows, input stages, objective and the allowed error, the
sources of the search, and the version of numpy. What is read is a proposal like that of the search itself: the proof
decides whether a design may have it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from sosmith.gen.realizations.kept_files import digest_of_sources, folder_in_cache, keep, read_kept
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

_SOURCES = (
    *("gen/architectures", "gen/filter", "gen/fpga", "gen/proof", "gen/realizations", "gen/word_lengths", "hdl/plan"),
    *("model/arithmetic", "model/dataflow", "model/sections"),
)
"""What decides on the result, from the folder that holds the rooms."""


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
    tree = read_kept(place)
    if tree is not None:
        return of_tree(tree[0])
    result = make()
    keep(place, to_tree(result), LIMIT)
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
    return folder_in_cache("trimmed")


def _sources() -> str:
    """Return a digest of the sources, and of what computes the responses."""
    return digest_of_sources(_SOURCES, np.__version__)
