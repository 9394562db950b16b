"""Reads the C model of a core, and proves that it computes the graphs of its certificate."""
