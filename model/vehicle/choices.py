"""The names that a run of the vehicle chooses from: tracks, and levels of irregularity."""

TRACK_NAMES = ("paper", "tangent")
"""The paper's track with its curve, and a straight one of the same length."""

LEVELS = ("low", "high")
"""Levels of disturbance of ERRI B176."""
