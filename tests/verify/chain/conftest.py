"""Fixtures of the tests of chains' proofs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from sosmith.verify.certificate_file import Certificate
from sosmith.verify.chain import check
from sosmith.verify.verdict.door import Judgement, judge
from sosmith.verify.verification import Progress

_JUDGED: dict[tuple[object, ...], Judgement] = {}


@pytest.fixture(autouse=True)
def _stages_are_judged_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Judge a stage once as long as its files are the same: most tests change what is around them."""

    def once(core: Certificate, progress: Progress, *, folder: Path | None, **options: Any) -> Judgement:
        own = [] if folder is None else sorted(folder.glob(f"{core.name}*"))
        stated = options["stated"]
        words = None if stated is None else replace(stated, folder=Path())  # a stage without measurements
        key = (*((path.name, path.is_symlink(), path.read_bytes()) for path in own), options["content"], words)
        if key not in _JUDGED:
            _JUDGED[key] = judge(core, progress, folder=folder, **options)
        return _JUDGED[key]

    monkeypatch.setattr(check, "judge", once)
