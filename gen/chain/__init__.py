"""Chains: proven designs one behind the other, each with its own rate, and one bound from end to end."""
