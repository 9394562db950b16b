"""Proves a CIC filter that has an adder for each of its integrators and combs."""
