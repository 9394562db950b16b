"""Traces of input codes and sensor signals, as arrays and as files."""
