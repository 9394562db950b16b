"""Whether a process lives."""

from __future__ import annotations

from pathlib import Path


def lives(pid: int) -> bool:
    """Whether there is such a process, and more of it than its entry in the table."""
    try:
        return (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
