"""Proves that sections which share hardware, a turn each, compute the graph of a certificate."""
