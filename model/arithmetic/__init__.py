"""Arithmetic that is the same on every machine: balls, products of matrices, elementary functions, random streams."""
