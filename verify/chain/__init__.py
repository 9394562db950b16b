"""Proves chains: the stages one by one, what follows for all of them together, and how they are joined."""
