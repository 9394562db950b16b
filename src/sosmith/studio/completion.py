"""What makes a changed filter complete: the keys that its form needs, and those that have to go."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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


def completed(table: Mapping[str, Any], rate: float, named: Sequence[str]) -> dict[str, Any]:
    """Return the changes that make the table of a filter complete: None for a key that has to go.

    Parameters
    ----------
    table : mapping
        The table as it is, with what was changed.
    rate : float
        Samples per second.
    named : sequence of str
        Keys that were changed: of two forms, the one that was changed last stays.
    """
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
        fits = _fit(kind, edges, stop) and ("stopband_edge" in named or _below(stop, half))
        wanted |= {"passband_edge": edges, "stopband_edge": stop if fits else _beyond(kind, edges, half)}
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
    return [given, short(min(2 * given, (given + half) / 2))]


def _fit(kind: str, edges: Any, stop: Any) -> bool:
    """Whether edges of the stopband lie where they must beside those of the passband."""
    rising = {"lowpass": (True,), "highpass": (False,), "bandpass": (False, True), "bandstop": (True, False)}[kind]
    ours, theirs = (value if isinstance(value, list) else [value] for value in (edges, stop))
    if not _numbers(theirs) or not len(ours) == len(theirs) == len(rising):
        return False
    return all((a < b) == up for a, b, up in zip(ours, theirs, rising, strict=True))


def _below(edges: Any, half: float) -> bool:
    """Whether edges are below half the sample rate, as those are not that followed one of the passband beyond it."""
    return all(edge < half for edge in (edges if isinstance(edges, list) else [edges]))


def _beyond(kind: str, edges: Any, half: float) -> Any:
    """Return edges of a stopband about an octave beyond those of the passband."""
    low, high = (edges[0], edges[-1]) if isinstance(edges, list) else (edges, edges)
    above, below, quarter = min(2 * high, (high + half) / 2), low / 2, (high - low) / 4
    return {
        "lowpass": short(above),
        "highpass": short(below),
        "bandpass": [short(below), short(above)],
        "bandstop": [short(low + quarter), short(high - quarter)],
    }[kind]


def short(value: float) -> float:
    """Return a number with six digits."""
    return float(f"{value:.6g}")
