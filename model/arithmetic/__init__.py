"""Arithmetic that is the same on every machine: balls, algebra of matrices, elementary functions, random streams."""
