"""How deep nets are followed back: deeper than Python goes by itself."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from sosmith.verify.graph import RejectedError

_DEEPEST = 20_000
"""Calls inside each other: some for each operator between two registers, and several lanes one after the other."""


@contextmanager
def deep_recursion() -> Iterator[None]:
    """Let nets be followed back as far as they go.

    Raises
    ------
    RejectedError
        If they go further than that.
    """
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(max(before, _DEEPEST))
    try:
        yield
    except RecursionError:
        raise RejectedError("nets must not follow each other as far as that") from None
    finally:
        sys.setrecursionlimit(before)
