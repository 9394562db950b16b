"""Bounds on responses: sums of magnitudes, largest gains, and inputs that are driven from elsewhere."""
