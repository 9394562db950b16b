"""Levels of sound: signals without a unit, whose full scale is 1, in dB of full scale."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sosmith.model.port import Port


def is_sound(inputs: Sequence[Port], output: Port) -> bool:
    """Whether a core is for sound: one input from -1 to 1, with a sign, and no units."""
    if len(inputs) != 1:
        return False
    (only,) = inputs
    return only.signed and output.signed and not (only.unit or output.unit) and only.lsb * (1 << (only.bits - 1)) == 1


def peak_dbfs(value: float) -> float | None:
    """Return the level of a largest magnitude in dB of full scale; None for 0."""
    return 20 * math.log10(value) if value else None


def rms_dbfs(value: float) -> float | None:
    """Return the level of an effective value in dB of full scale; None for 0.

    By AES17, a sine over the whole scale, whose effective value is ``1 / sqrt(2)``, is at 0 dB.
    """
    return 20 * math.log10(value * math.sqrt(2)) if value else None
