"""Valid names for a vehicle run: tracks, and levels of track irregularity."""

TRACK_NAMES = ("paper", "tangent")
"""The paper's track with its curve, and a straight one of the same length."""

LEVELS = ("low", "high")
"""Disturbance levels of ERRI B176."""

MODELS = ("nonlinear", "linear")
"""Models of the contacts of wheels and rails."""
