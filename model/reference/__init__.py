"""The golden model in double precision, and measures of accuracy against it."""
