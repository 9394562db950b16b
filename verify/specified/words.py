"""Reads the text of a specification as a tree of TOML, whose numbers are the decimal fractions that are written."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from decimal import Decimal
from fractions import Fraction
from typing import Any

from sosmith.verify.graph import RejectedError, require


def words_of(text: str) -> dict[str, Any]:
    """Return the tree of a specification's text.

    Raises
    ------
    RejectedError
        If it is no TOML.
    """
    try:
        return tomllib.loads(text.removeprefix("\ufeff"), parse_float=Decimal)
    except (ValueError, ArithmeticError, RecursionError):
        raise RejectedError("the specification must be TOML") from None


def table_of(tree: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """Return a table of a specification; an empty one if it is not there.

    Raises
    ------
    RejectedError
        If anything else stands there.
    """
    table = tree.get(key, {})
    require(isinstance(table, dict), f"{key} of the specification must be a table")
    return dict(table)


def with_fractions(value: Any) -> Any:
    """Return a tree with every number as a fraction."""
    if isinstance(value, Mapping):
        return {key: with_fractions(item) for key, item in value.items()}
    if isinstance(value, list):
        return [with_fractions(item) for item in value]
    if isinstance(value, int | Decimal) and not isinstance(value, bool):
        return Fraction(value)
    return value
