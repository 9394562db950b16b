"""Converters at the pins of a simulated board, which behave as their data sheets say."""
