"""Limits on the bits of coefficients and signals that are tried."""

MIN_BITS = 4
"""Significant bits of a coefficient at which the search starts."""

MAX_BITS = 40
"""Largest number of significant bits of a coefficient, and of fraction bits of a signal, that is tried. No useful
design needs more."""
