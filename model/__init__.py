"""Bit-true arithmetic, its double-precision reference, and the emulated instrument that feeds it."""
