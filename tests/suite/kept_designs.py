"""Designs are searched for once in each process of the tests: the same specification gives the same design.

A plugin, so that the mutation bench can leave it out: there, each test is to execute what it looks at.
"""

from __future__ import annotations

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


def _key(search: Any, kinds: Sequence[type]) -> bytes | None:
    """Return all that the search depends on; None where that cannot be written down."""
    spec = replace(search.spec, path=Path())
    try:
        return pickle.dumps(
            (spec, search.response, search.asked, search.budget, search.board, [kind.__name__ for kind in kinds])
        )
    except (TypeError, AttributeError, pickle.PicklingError):
        return None


@pytest.fixture(autouse=True)
def _designs_are_kept(searches_anew: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Take a design that was found before, its steps told again, but where the search itself is tested."""
    module = sys.modules.get("sosmith.gen.architectures.search")
    if module is None or searches_anew:
        return
    found = module.Search.first_that_keeps_up

    def kept(search: Any, kinds: Sequence[type]) -> Any:
        key = _key(search, kinds)
        if key is None or key not in _kept:
            steps: list[str] = []

            def progress(step: str) -> None:
                steps.append(step)
                search.progress(step)

            result = found(replace(search, progress=progress), kinds)
            if key is None:
                return result
            _kept[key] = steps, result
            if len(_kept) > MOST:
                _kept.popitem(last=False)
        else:
            for step in _kept[key][0]:
                search.progress(step)
        _kept.move_to_end(key)
        return _kept[key][1]

    monkeypatch.setattr(module.Search, "first_that_keeps_up", kept)
