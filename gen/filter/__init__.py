"""Filter design, from the specification to second-order sections, correctly rounded, and their frequency response."""
