"""What the page knows of a text, right or wrong: its keys, its stages, and which of these an error is about."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from sosmith.studio.edits import parsed, sample_rate
from sosmith.studio.new_stages import rates
from sosmith.studio.stage_list import stages_of

_LARGEST = 1 << 53
"""Integers beyond it are none that a page can read."""


def described(text: str, former: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of a text as `keys`, and its `stages`: rates in Hz in and out; None for a single core.

    Parameters
    ----------
    text : str
    former : mapping
        What was said of the text before, which stands as long as this one is no TOML.
    """
    tree = parsed(text)
    try:
        keys = _plain(tree)
    except RecursionError:
        tree = None
    if tree is None:
        return {"keys": former.get("keys", {}), "stages": former.get("stages"), "readable": False}
    stages = stages_of(text)
    return {
        "keys": keys,
        "stages": None
        if stages is None
        else [[_plain(before), _plain(after)] for before, after in rates(stages, _rate(tree))],
        "readable": True,
    }


def told(error: str, text: str) -> dict[str, Any]:
    """Return an error, and what of it is `wrong` with each stage of a text."""
    return {"error": error, "wrong": errors_by_stage(error, [stage.get("name") for stage in stages_of(text) or ()])}


def errors_by_stage(error: str, names: Sequence[Any]) -> list[str]:
    """Return what is wrong with each stage: an empty text for one about which there is no sentence.

    Parameters
    ----------
    error : str
        Sentences, each on a line of its own.
    names : sequence
        Names of the stages, whatever they are.

    Examples
    --------
    >>> errors_by_stage("my.toml: stage[1].order must be given for a CIC filter, not missing", ["a", "b"])
    ['', 'order must be given for a CIC filter, not missing']
    >>> errors_by_stage("my.toml: stage a: filter.cutoff must be positive, not -1", ["a", "b"])
    ['cutoff must be positive, not -1', '']
    """
    found: list[list[str]] = [[] for _ in names]
    for line in error.splitlines():
        numbered = re.search(r"\bstage\[(\d+)\]\.?(.*)", line)
        named = re.search(r"\bstage ([^\s:]+): (?:filter\.|filter's )?(.*)", line)
        k, said = -1, ""
        if numbered:
            k, said = int(numbered[1]), numbered[2]
        elif named:
            k, said = _number_of(named[1], names), re.sub("^kind must", "band must", named[2])
        if 0 <= k < len(found):
            found[k].append(said.strip())
    return ["; ".join(each) for each in found]


def _rate(tree: Mapping[str, Any]) -> float:
    """Return the samples per second; infinitely many where these are no number."""
    try:
        return sample_rate(tree)
    except (TypeError, ValueError, OverflowError):
        return math.inf


def _number_of(name: str, names: Sequence[Any]) -> int:
    """Return the number of the stage with a name, or with a core of that name for one of its results; -1 for none."""
    for k, each in enumerate(names):
        if name == each or re.fullmatch(rf"{re.escape(str(each))}_p\d+", name):
            return k
    return -1


def _plain(value: Any) -> Any:
    """Return a value of TOML in types of JSON that a page can read."""
    match value:
        case dict():
            return {str(key): _plain(each) for key, each in value.items()}
        case list():
            return [_plain(each) for each in value]
        case bool() | str() | None:
            return value
        case int():
            return value if abs(value) <= _LARGEST else float(f"{value:.6g}") if value.bit_length() < 1000 else None
        case float():
            return value if math.isfinite(value) else None
    return str(value)
