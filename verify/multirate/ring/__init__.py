"""Proves hardware that keeps its samples in rings of memory, clock by clock."""
