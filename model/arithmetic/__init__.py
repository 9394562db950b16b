"""Arithmetic whose results are the same on every machine: balls, products of matrices, elementary functions."""
