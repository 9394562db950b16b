"""The hint in a message about an unknown name."""

from __future__ import annotations

import pytest

from sosmith.model.suggestion import did_you_mean


@pytest.mark.parametrize(
    ("name", "known", "hint"),
    [
        ("cutof", ["order", "cutoff"], " (did you mean cutoff?)"),
        ("ordre", iter(["order", "cutoff"]), " (did you mean order?)"),
        ("gain", ["order", "cutoff"], ""),
        ("gain", [], ""),
        ("", ["order"], ""),
    ],
)
def test_the_closest_name_is_offered(name: str, known: list[str], hint: str) -> None:
    assert did_you_mean(name, known) == hint
