"""New coefficients for existing hardware: designed, proven, and turned into register writes."""
