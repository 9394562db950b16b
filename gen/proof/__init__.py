"""Exact linear models, worst-case peak gains, the proof of a cascade, limit cycles."""
