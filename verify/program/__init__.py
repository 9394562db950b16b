"""Proves that the program of a folded or serial core, as emitted, computes the graph of its certificate."""
