"""Proves that the unit of a folded or serial core, as emitted, runs its program for all inputs, stalls and resets."""
