"""What a calibration accepts: the ranges of measurements, and how well a polynomial has to fit."""

REQUIRED_R = 0.975
"""Adjusted r at which a polynomial is accepted (the paper's section 2.2)."""

Range = tuple[float, float]
"""Least and largest value that can be right."""

DEFAULT_RANGES: tuple[Range, Range, Range] = ((0.0, 16.0), (0.0, 10.0), (0.0, 128.0))
"""Ranges of clearance, voltage and temperature in mm, V and degC: those of the example specification."""
