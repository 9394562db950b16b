"""How the files of traces are named. Loads quickly."""

from __future__ import annotations

WAV = (".wav", ".wave")
OTHER_SOUND = (".aac", ".aif", ".aiff", ".flac", ".m4a", ".mp3", ".ogg", ".opus", ".wma")
"""Formats of sound that are not read."""


def is_trace_file(source: str) -> bool:
    """Whether the name of a source is that of a trace file, and not of a scenario, whether it is there or not."""
    return source.lower().endswith((".csv", *WAV, *OTHER_SOUND))
