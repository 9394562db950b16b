"""Designs are searched for once, also if several processes test: the same specification gives the same design.

A plugin, so that the mutation bench can leave it out: there, each test is to execute what it looks at.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import sys
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

MOST = 128
"""Designs that are kept, those that were asked for last."""

_kept: OrderedDict[bytes, tuple[list[str], Any]] = OrderedDict()
"""What this process has found or read: the steps that were told, and the design."""


def _key(search: Any, kinds: Sequence[type]) -> bytes | None:
    """Return all that the search depends on; None where that cannot be written down."""
    spec = replace(search.spec, path=Path())
    try:
        return pickle.dumps(
            (spec, search.response, search.asked, search.budget, search.board, [kind.__name__ for kind in kinds])
        )
    except (TypeError, AttributeError, pickle.PicklingError):
        return None


@pytest.fixture(scope="session")
def _designs(run_folder: Path) -> Path:
    """Return a folder of this run alone for what its processes find."""
    folder = run_folder / "designs"
    folder.mkdir(exist_ok=True)
    return folder


def _read(place: Path) -> tuple[list[str], Any] | None:
    try:
        kept: tuple[list[str], Any] = pickle.loads(place.read_bytes())
    except FileNotFoundError:
        return None
    return kept


def _write(place: Path, kept: tuple[list[str], Any]) -> None:
    """Write a file at once: another process may read it at any moment, or write the same."""
    own = place.with_suffix(f".{os.getpid()}")
    own.write_bytes(pickle.dumps(kept))
    own.replace(place)


@pytest.fixture(autouse=True)
def _designs_are_kept(searches_anew: bool, monkeypatch: pytest.MonkeyPatch, _designs: Path) -> None:
    """Take a design that was found before, its steps told again, but where the search itself is tested."""
    module = sys.modules.get("sosmith.gen.architectures.search")
    if module is None or searches_anew:
        return
    found = module.Search.first_that_keeps_up

    def kept(search: Any, kinds: Sequence[type]) -> Any:
        key = _key(search, kinds)
        if key is None:
            return found(search, kinds)
        place = _designs / hashlib.sha256(key).hexdigest()
        known = _kept.get(key) or _read(place)
        if known is None:
            steps: list[str] = []

            def progress(step: str) -> None:
                steps.append(step)
                search.progress(step)

            known = steps, found(replace(search, progress=progress), kinds)
            _write(place, known)
        else:
            for step in known[0]:
                search.progress(step)
        _kept[key] = known
        _kept.move_to_end(key)
        if len(_kept) > MOST:
            _kept.popitem(last=False)
        return known[1]

    monkeypatch.setattr(module.Search, "first_that_keeps_up", kept)
