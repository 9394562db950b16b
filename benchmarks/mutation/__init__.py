"""Mutation testing: finds operators, numbers and comparisons of the code that no test depends on."""
