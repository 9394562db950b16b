"""From ``[wear]`` in the specification to the output codes at which the hardware's flags of wear rise."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

from sosmith.model.port import Port


@dataclass(frozen=True, kw_only=True)
class WearSpec:
    """What the output, a clearance, means for a wheel; all in the output's unit.

    The wear is the clearance minus the initial one, the paper's ``s_w = s_r - s_i``.

    Attributes
    ----------
    initial : tuple of Fraction
        Clearance without wear, one for all channels or one for each.
    warning : Fraction
        Wear from which on there is a warning, above 0.
    limit : Fraction
        Wear from which on it is critical, above `warning`.
    sensor_range : Fraction or None
        Clearance up to which the sensor can be trusted: from there on the wear counts as critical too.
    """

    initial: tuple[Fraction, ...]
    warning: Fraction
    limit: Fraction
    sensor_range: Fraction | None = None

    def clearances(self) -> tuple[tuple[Fraction, Fraction], ...]:
        """Clearances from which on the wear is a warning and critical, for all channels or for each."""
        ends = [initial + self.limit for initial in self.initial]
        if self.sensor_range is not None:
            ends = [min(end, self.sensor_range) for end in ends]
        return tuple((initial + self.warning, end) for initial, end in zip(self.initial, ends, strict=True))

    def codes(self, output: Port) -> tuple[tuple[int, int], ...]:
        """Lowest codes of `output` that have reached these clearances; a single pair if all channels have the same."""
        pairs = [tuple(math.ceil((c - output.zero) / output.lsb) for c in pair) for pair in self.clearances()]
        return tuple((low, high) for low, high in (pairs[:1] if len(set(pairs)) == 1 else pairs))
