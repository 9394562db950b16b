"""What an item may state of itself."""

from math import inf
from types import SimpleNamespace
from typing import Any

import pytest

from sosmith.verify.graph import RejectedError
from sosmith.verify.verdict.item import wear_limits
from sosmith.verify.verdict.scope import _why_not


@pytest.mark.parametrize(
    "table",
    [
        {"initial": inf, "warning": 1, "limit": 2},
        {"initial": 1, "warning": "much", "limit": 2},
        {"initial": 1, "warning": {}, "limit": 2},
        {"initial": 1, "warning": 1},
    ],
)
def test_limits_of_wear_are_numbers(table: dict[str, Any]) -> None:
    with pytest.raises(RejectedError, match=r"^wear of the specification must be its limits$"):
        wear_limits(table)


@pytest.mark.parametrize(
    ("item", "sentence"),
    [
        (None, "the certificate does not state what the item is"),
        ({"shared": True}, "its hardware is a module of a chain, and proven with that"),
        ({"reload": True}, "constants that can be loaded are not proven"),
        ({"reload": False, "protect": "detect"}, "hardware with protection against upsets is not proven"),
        (
            {"reload": False, "protect": "none", "architecture": "online"},
            "the hardware of the architecture online is not proven",
        ),
    ],
)
def test_what_is_not_proven_is_said(item: dict[str, Any] | None, sentence: str) -> None:
    assert _why_not(None if item is None else SimpleNamespace(**({"shared": False} | item))) == sentence
