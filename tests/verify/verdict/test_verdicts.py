"""What is proven of a core of every architecture with every option: as the table of docs/assurance.md says."""

from __future__ import annotations

import json
from typing import Any

import pytest
from benchmarks import verdicts

RECORD: dict[str, Any] = json.loads(verdicts.RECORD.read_text(encoding="utf-8"))
FAST = ("parallel", "parallel, look-ahead", "online, 3 channels")


def _said(found: dict[str, Any]) -> dict[str, Any]:
    """Return a verdict without what the machine decides."""
    return {key: value for key, value in found.items() if key not in {"making", "verifying"}}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in FAST else pytest.mark.slow) for name in verdicts.specifications()]
)
def test_what_is_proven_is_what_the_document_says(name: str) -> None:
    found = _said(verdicts.campaign([name])[name])
    assert found == _said(RECORD[name])


def test_the_document_has_the_record() -> None:
    text = verdicts.DOCUMENT.read_text(encoding="utf-8")
    (part,) = verdicts.PART.findall(text)
    assert part == verdicts.table(RECORD)
    assert RECORD.keys() == verdicts.specifications().keys()


def test_a_plain_core_of_each_architecture_that_is_proven_is_proven_as_a_whole() -> None:
    for name in ("parallel", "folded", "serial"):
        for option in ("", ", 3 channels", ", from zero"):
            assert RECORD[name + option]["missing"] == {}
