"""The quality that a fit to measurements must reach."""

REQUIRED_R = 0.975
"""Adjusted r at which a polynomial is accepted (the paper's section 2.2)."""
