"""Filter design, from the specification to second-order sections, and their frequency response."""
