"""The hint in a message about an unknown name: which known name was probably meant."""

from __future__ import annotations

from collections.abc import Iterable


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return " (did you mean NAME?)" with the `known` name that resembles `name` most, or "" if none does.

    To be put at the end of a message about an unknown name.
    """
    import difflib  # only what is unknown needs it

    closest = difflib.get_close_matches(name, list(known), n=1)
    return f" (did you mean {closest[0]}?)" if closest else ""
