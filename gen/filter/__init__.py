"""Filter design, from the specification to correctly rounded second-order sections, and their frequency response."""
