"""Changes to the text of a specification, which leave its comments and its layout as they are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sosmith import Specification

BY_ORDER = ("order", "cutoff")
BY_MASK = ("passband_edge", "stopband_edge")
FREEDOM = "freedom"
GIVEN = ("sos", "sos_file", "taps", "taps_file")
LOSSES = {"passband_loss": 1.0, "stopband_loss": 40.0}
"""Losses in dB, and what they are where a form needs one that is not there yet."""
ORDER = 4
"""The order where there is none yet."""


def changed(text: str, changes: Mapping[str, Any]) -> str:
    r"""Return the text of a TOML file with other values at some keys.

    A changed filter is kept complete: with another form, family or kind come the keys that these need, and those that
    they refuse go.

    Parameters
    ----------
    text : str
        The text, valid TOML.
    changes : mapping
        Values by the paths of their keys, such as ``{"filter.cutoff": 10.0}``; None removes a key.

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
    for path, value in changes.items():
        *tables, key = path.split(".")
        place: Any = document
        for name in tables:
            if name not in place:
                place[name] = tomlkit.table()
            place = place[name]
        _put(place, key, value)
    if any(path.startswith("filter.") for path in changes):
        table = document["filter"]
        for key, value in completed(table.unwrap(), float(document.unwrap().get("sample_rate", 1)), changes).items():
            _put(table, key, value)
    return tomlkit.dumps(document)


def _put(table: Any, key: str, value: Any) -> None:
    if value is None:
        table.pop(key, None)
    elif key not in table or table[key] != value:
        table[key] = value


def completed(table: Mapping[str, Any], rate: float, changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the changes that make the table of a filter complete: None for a key that has to go.

    Parameters
    ----------
    table : mapping
        The table as it is, with what was changed.
    rate : float
        Samples per second.
    changes : mapping
        What was changed, by the paths of the keys: of two forms, the one that was changed last stays.
    """
    named = [path.removeprefix("filter.") for path in changes]
    forms = [key for key in named if key in (*BY_ORDER, *BY_MASK)] or [
        key for key in (*BY_MASK, *BY_ORDER) if key in table
    ]
    kind, half = str(table.get("kind")), rate / 2
    if not forms or kind not in Specification.choices()["filter.kind"]:
        return {}  # given by its sections, or wrong: the specification says how
    by_mask = forms[-1] in BY_MASK if set(named) & {*BY_ORDER, *BY_MASK} else forms[0] in BY_MASK
    needed = (*BY_MASK, *LOSSES) if by_mask else (*BY_ORDER, *Specification.losses(str(table.get("family"))))
    gone = {key for key in (*BY_ORDER, *BY_MASK, *LOSSES, *GIVEN) if key in table and key not in needed}
    if FREEDOM in table and not by_mask:
        gone.add(FREEDOM)
    wanted: dict[str, Any] = {key: table.get(key, loss) for key, loss in LOSSES.items() if key in needed}
    edges = _edges(table.get("passband_edge" if by_mask else "cutoff"), kind, half)
    if by_mask and _numbers(edges):
        stop = _edges(table.get("stopband_edge"), kind, half)
        wanted |= {
            "passband_edge": edges,
            "stopband_edge": stop if _fit(kind, edges, stop) else _beyond(kind, edges, half),
        }
    elif not by_mask:
        wanted |= {"order": table.get("order", ORDER), "cutoff": edges}
    return dict.fromkeys(sorted(gone)) | {key: value for key, value in wanted.items() if table.get(key) != value}


def _numbers(edges: Any) -> bool:
    return all(isinstance(value, int | float) for value in (edges if isinstance(edges, list) else [edges]))


def _edges(given: Any, kind: str, half: float) -> Any:
    """One edge for a low-pass or a high-pass, else two."""
    if kind not in {"bandpass", "bandstop"}:
        return given[0] if isinstance(given, list) and given else given
    if isinstance(given, list) or not _numbers(given):
        return given
    return [given, _short(min(2 * given, (given + half) / 2))]


def _fit(kind: str, edges: Any, stop: Any) -> bool:
    """Whether edges of the stopband lie where they must beside those of the passband."""
    rising = {"lowpass": (True,), "highpass": (False,), "bandpass": (False, True), "bandstop": (True, False)}[kind]
    ours, theirs = (value if isinstance(value, list) else [value] for value in (edges, stop))
    if not _numbers(theirs) or not len(ours) == len(theirs) == len(rising):
        return False
    return all((a < b) == up for a, b, up in zip(ours, theirs, rising, strict=True))


def _beyond(kind: str, edges: Any, half: float) -> Any:
    """Return edges of a stopband about an octave beyond those of the passband."""
    low, high = (edges[0], edges[-1]) if isinstance(edges, list) else (edges, edges)
    above, below, quarter = min(2 * high, (high + half) / 2), low / 2, (high - low) / 4
    return {
        "lowpass": _short(above),
        "highpass": _short(below),
        "bandpass": [_short(below), _short(above)],
        "bandstop": [_short(low + quarter), _short(high - quarter)],
    }[kind]


def _short(value: float) -> float:
    return float(f"{value:.6g}")
