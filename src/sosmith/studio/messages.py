"""Checks of what pages say: each raises `MessageError` where no page of ours says it."""

from __future__ import annotations

from typing import Any

from sosmith import ChainSpecification
from sosmith.host.loopback import MessageError


def typed(message: dict[str, Any], key: str, kind: type, default: Any = None) -> Any:
    """Return what a message has at a key, or else the default; it must be of a kind."""
    value = message.get(key, default)
    if not isinstance(value, kind):
        raise MessageError
    return value


def short(text: str, longest: int) -> str:
    """Check a text from a page: that it is not longer, and can be written as UTF-8."""
    if len(text) > longest:
        raise MessageError
    try:
        text.encode()
    except UnicodeEncodeError:  # half a character, which JSON can say
        raise MessageError from None
    return text


def kind_in(message: dict[str, Any]) -> str:
    """Return the kind of a new stage."""
    kind: str = typed(message, "kind", str)
    if kind not in ChainSpecification.kinds():
        raise MessageError
    return kind
