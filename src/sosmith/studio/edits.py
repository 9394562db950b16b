"""Changes to the text of a specification, which leave its comments and its layout as they are."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import Any

from sosmith.studio.completion import completed
from sosmith.studio.new_stages import completed_stage

STAGE = "stage"
"""Key of the list of stages."""


def changed(text: str, changes: Mapping[str, Any]) -> str:
    r"""Return the text of a TOML file with other values at some keys.

    A changed filter or stage is kept complete: with another form, family or kind come the keys that these need, and
    those that they refuse go.

    Parameters
    ----------
    text : str
        The text, valid TOML.
    changes : mapping
        Values by the paths of their keys, such as ``{"filter.cutoff": 10.0}`` or ``{"stage.0.order": 3}``; None removes
        a key.

    Raises
    ------
    tomlkit.exceptions.TOMLKitError
        If the text is no TOML.

    Examples
    --------
    >>> print(changed("[filter]\norder = 5  # poles\ncutoff = 2.0 # Hz", {"filter.cutoff": 3.5}))
    [filter]
    order = 5  # poles
    cutoff = 3.5 # Hz
    """
    import tomlkit

    document = tomlkit.parse(text)
    named: dict[tuple[str, ...], list[str]] = {}
    for path, value in changes.items():
        *tables, key = path.split(".")
        place: Any = document
        for name in tables:
            if isinstance(place, list):
                place = place[_index(name)]
                continue
            if name not in place:
                place[name] = tomlkit.table()
            place = place[name]
        _put(place, key, value)
        named.setdefault(tuple(tables), []).append(key)
    for path_of_table, keys in named.items():
        rate = sample_rate(document.unwrap())
        if path_of_table == ("filter",):
            _complete(document["filter"], completed(document["filter"].unwrap(), rate, keys))
        elif len(path_of_table) == 2 and path_of_table[0] == STAGE:
            stages, k = document.unwrap()[STAGE], _index(path_of_table[1])
            _complete(document[STAGE][k], completed_stage(stages, k, rate, keys))
    return tomlkit.dumps(document)


def sample_rate(tree: Mapping[str, Any]) -> float:
    """Return the samples per second of a specification, 1 where none are given.

    Raises
    ------
    TypeError, ValueError, OverflowError
        If they are no number.
    """
    return float(tree.get("sample_rate", 1))


def parsed(text: str) -> dict[str, Any] | None:
    """Return what is in a text; None if it is no TOML."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError):
        return None


def _index(name: str) -> int:
    """Return the number of a stage, which is counted from the first one on only."""
    if not name.isdecimal():
        raise LookupError(name)
    return int(name)


def _complete(table: Any, changes: Mapping[str, Any]) -> None:
    for key, value in changes.items():
        _put(table, key, value)


def _put(table: Any, key: str, value: Any) -> None:
    if value is None:
        table.pop(key, None)
    elif key not in table or table[key] != value:
        table[key] = value
