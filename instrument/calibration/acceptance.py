"""Acceptance criteria of a calibration: the valid ranges of measurements, and the required quality of the fit."""

from typing import Literal

Method = Literal["paper", "bayes"]
"""How a calibration is fitted: by the paper's rule, or by the mixed-effects model."""

METHODS: tuple[Method, ...] = ("bayes", "paper")

Range = tuple[float, float]
"""Smallest and largest valid value."""

DEFAULT_RANGES: tuple[Range, Range, Range] = ((0.0, 16.0), (0.0, 10.0), (0.0, 128.0))
"""Default ranges of clearance, voltage and temperature in mm, V and degC, as in the example specification."""
