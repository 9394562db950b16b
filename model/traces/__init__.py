"""Traces of codes and signals of sensors, as arrays and as files."""
