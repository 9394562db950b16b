"""Modules of a chain that no core has: what joins cores, their flags and their registers."""
