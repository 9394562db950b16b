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
        Texts, numbers (`Decimal` ones exactly), bools, lists of these, mappings, which become tables, and lists of
        mappings. Empty mappings are left out.

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
    plain = {key: value for key, value in tree.items() if not isinstance(value, Mapping) and not _is_list(value)}
    lines = [f"{key_text(key)} = {_value(value)}\n" for key, value in plain.items()]
    header = [f"{_header(path)}\n"] if path and lines else []
    texts = ["".join(header + lines)] if lines else []
    for key, value in tree.items():
        if isinstance(value, Mapping):
            texts += _tables(value, (*path, key))
        elif _is_list(value):
            for table in value:
                first, *others = _tables(table, (*path, key))
                texts += [first.replace(_header((*path, key)), f"[{_header((*path, key))}]", 1), *others]
    return texts


def _is_list(value: Any) -> bool:
    """Whether it is a list of tables."""
    return isinstance(value, list | tuple) and bool(value) and all(isinstance(item, Mapping) for item in value)


def _header(path: tuple[str, ...]) -> str:
    """Return the line before a table."""
    return f"[{'.'.join(map(key_text, path))}]"


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
