"""How many bits of a coefficient or a signal are tried."""

MIN_BITS = 4
"""Significant bits of a coefficient that are tried first."""

MAX_BITS = 40
"""Most significant bits of a coefficient that are tried, and most fraction bits of a signal: no useful design needs
more."""
