"""Leaves out the comments of a text in SystemVerilog, for caches of what tools make of it."""

from __future__ import annotations

import re

_COMMENT = re.compile(r"^ *//.*\n", re.MULTILINE)


def without_comments(text: str) -> str:
    """Remove the lines that are comments: what is left decides what the hardware does."""
    return _COMMENT.sub("", text)
