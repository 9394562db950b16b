"""Other coefficients for hardware that exists: made, proven, and written as register writes."""
