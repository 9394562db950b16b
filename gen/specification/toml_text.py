"""Writes a specification as TOML: plain keys first, then the tables."""

from __future__ import annotations

import json
from collections.abc import Mapping
from decimal import Decimal
from typing import Any

from sosmith.gen.specification.values import key_text


def toml_text(tree: Mapping[str, Any]) -> str:
    """Return `tree` as TOML; reading the text gives the same values.

    Parameters
    ----------
    tree : mapping of str
        Texts, numbers (`Decimal` ones exactly), bools, lists of these, and mappings, which become tables. Empty
        mappings are left out.

    Examples
    --------
    >>> print(toml_text({"name": "plain", "input": {"x": {"bits": 12}}}), end="")
    name = "plain"
    <BLANKLINE>
    [input.x]
    bits = 12
    """
    return "\n".join(_tables(tree, ()))


def _tables(tree: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    """Return the texts of a table and of its nested tables."""
    lines = [f"{key_text(key)} = {_value(value)}\n" for key, value in tree.items() if not isinstance(value, Mapping)]
    header = [f"[{'.'.join(map(key_text, path))}]\n"] if path and lines else []
    texts = ["".join(header + lines)] if lines else []
    for key, value in tree.items():
        if isinstance(value, Mapping):
            texts += _tables(value, (*path, key))
    return texts


def _value(value: Any) -> str:
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            return json.dumps(value, ensure_ascii=False)
        case Decimal():
            # As a float prints where that is the same number: the usual case.
            return repr(float(value)) if Decimal(repr(float(value))) == value else str(value)
        case list() | tuple():
            return f"[{', '.join(map(_value, value))}]"
        case _:
            return repr(value)
