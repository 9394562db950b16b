"""Ideal filters: prototypes, transformations and sections, derived in ball arithmetic and rounded once."""
