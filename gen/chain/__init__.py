"""Chains: proven designs in series, each at its own rate, with one end-to-end bound."""
