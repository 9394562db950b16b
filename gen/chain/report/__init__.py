"""The report of a co-simulation of a chain: what ran, what identifies it, and its page."""
