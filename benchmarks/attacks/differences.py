"""Says where a text was changed."""

from __future__ import annotations

import difflib


def difference(right: str, wrong: str) -> str:
    """Return the lines that differ, at most a few."""
    lines = difflib.unified_diff(right.splitlines(), wrong.splitlines(), n=0, lineterm="")
    return " | ".join(ascii(line) for line in lines if line[:3] not in {"---", "+++"} and line[:2] != "@@")[:600]
