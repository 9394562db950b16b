"""The analog-to-digital converter: from physical values to the codes of a port, with errors and faults."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sosmith.model.arithmetic.random_streams import Streams
from sosmith.model.arrays import Codes, Values
from sosmith.model.port import Port


@dataclass(frozen=True, kw_only=True)
class Digitizer:
    """An analog-to-digital converter with errors; with all errors zero it gives the codes of `Port.encode`.

    ``code = round((1 + gain_error) * x + offset + inl * sin(2 pi u))`` with x the ideal code before rounding and u its
    position from 0 at the lowest code to 1 at the highest. Codes saturate at both ends.

    Attributes
    ----------
    offset : float
        Offset error in LSB.
    gain_error : float
        Gain error as a ratio, about code 0.
    inl : float
        Peak of the integral nonlinearity in LSB: an S-shaped curve, zero at both ends and in the middle (end-point
        fit).
    """

    offset: float = 0.0
    gain_error: float = 0.0
    inl: float = 0.0

    def codes(self, port: Port, values: Values) -> Codes:
        """Return the codes of physical `values` in the unit of `port`.

        Raises
        ------
        ValueError
            If a value is not finite.
        """
        if not np.all(np.isfinite(values)):
            raise ValueError(f"values of {port.name} must be finite, not {values[~np.isfinite(values)][0]!r}")
        ideal = (np.asarray(values, dtype=np.float64) - float(port.zero)) / float(port.lsb)
        place = np.clip((ideal - port.lowest) / (port.highest - port.lowest), 0.0, 1.0)
        bent = ideal * (1 + self.gain_error) + self.offset + self.inl * np.sin(2 * np.pi * place)
        return np.clip(np.floor(bent + 0.5), port.lowest, port.highest).astype(np.int64)


@dataclass(frozen=True, kw_only=True)
class CodeFault:
    """A fault of a converter during a range of samples.

    Attributes
    ----------
    start, stop : int
        First sample with the fault, and first one after it.
    share : float
        Probability that a sample is lost; 1 for a stuck code.
    code : int, optional
        Code that the converter is stuck at. Without it, a lost sample repeats the previous code; code 0 at the start
        of a trace.
    """

    start: int
    stop: int
    share: float = 1.0
    code: int | None = None

    def applied(self, codes: Codes, port: Port, chance: Streams) -> Codes:
        """Return `codes`, shape (n,), with the fault applied; `chance` is used if `share` is below 1."""
        index = np.arange(len(codes))
        lost = (index >= self.start) & (index < self.stop)
        if self.share < 1:
            lost &= chance(f"missing {port.name} from {self.start} to {self.stop}").random(len(codes)) < self.share
        if self.code is not None:
            return np.where(lost, np.clip(self.code, port.lowest, port.highest), codes)
        last = np.maximum.accumulate(np.where(lost, -1, index))
        return np.where(last < 0, np.clip(0, port.lowest, port.highest), codes[np.maximum(last, 0)])


def with_faults(codes: Codes, port: Port, faults: Sequence[CodeFault], chance: Streams) -> Codes:
    """Return `codes`, shape (n,), with all faults applied in order."""
    for fault in faults:
        codes = fault.applied(codes, port, chance)
    return codes
