"""From ``[wear]`` in the specification to the output codes at which the hardware sets its wear flags."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

from sosmith.model.port import Port


@dataclass(frozen=True, kw_only=True)
class WearSpec:
    """Wear limits of a wheel whose clearance is the output; all in the unit of the output.

    The wear is the clearance minus the initial one, the paper's ``s_w = s_r - s_i``.

    Attributes
    ----------
    initial : tuple of Fraction
        Clearance without wear, one for all channels or one per channel.
    warning : Fraction
        Wear at which the warning flag is set, above 0.
    limit : Fraction
        Wear at which the critical flag is set, above `warning`.
    sensor_range : Fraction or None
        Largest clearance that the sensor measures reliably: at this clearance the wear counts as critical too.
    """

    initial: tuple[Fraction, ...]
    warning: Fraction
    limit: Fraction
    sensor_range: Fraction | None = None

    def clearances(self) -> tuple[tuple[Fraction, Fraction], ...]:
        """Return the clearances of warning and critical wear, one pair for all channels or one per channel."""
        ends = [initial + self.limit for initial in self.initial]
        if self.sensor_range is not None:
            ends = [min(end, self.sensor_range) for end in ends]
        return tuple((initial + self.warning, end) for initial, end in zip(self.initial, ends, strict=True))

    def codes(self, output: Port) -> tuple[tuple[int, int], ...]:
        """Return the lowest codes of `output` at or above these clearances; one pair if all channels have the same."""
        pairs = [tuple(math.ceil((c - output.zero) / output.lsb) for c in pair) for pair in self.clearances()]
        return tuple((low, high) for low, high in (pairs[:1] if len(set(pairs)) == 1 else pairs))
