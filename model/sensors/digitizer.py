"""The analog-to-digital converter: physical values to the codes of a port, with its errors and its faults."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sosmith.model.arrays import Codes, Values
from sosmith.model.port import Port
from sosmith.model.random_streams import Streams


@dataclass(frozen=True, kw_only=True)
class Digitizer:
    """Errors of a converter, all zero for an ideal one, which then gives the codes of `Port.encode`.

    ``code = round((1 + gain_error) * x + offset + inl * sin(2 pi u))`` with x the ideal code before rounding and u its
    place between the lowest code, 0, and the highest, 1; what is beyond them is clipped.

    Attributes
    ----------
    offset : float
        In LSB.
    gain_error : float
        As a ratio, about code 0.
    inl : float
        Peak of the integral nonlinearity in LSB: an S, zero at both ends and in the middle, as after a fit
        to the end points.
    """

    offset: float = 0.0
    gain_error: float = 0.0
    inl: float = 0.0

    def codes(self, port: Port, values: Values) -> Codes:
        """Codes of physical `values` in the unit of `port`.

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
    """A fault of a converter over some samples.

    Attributes
    ----------
    start, stop : int
        First sample, and the first one after the fault.
    share : float
        Share of the samples that go missing, each by chance; 1 for a code that is stuck.
    code : int, optional
        Code that it is stuck at; without it a sample and hold gives the last code before, at the start of a trace 0.
    """

    start: int
    stop: int
    share: float = 1.0
    code: int | None = None

    def applied(self, codes: Codes, port: Port, chance: Streams) -> Codes:
        """Return the codes, shape (n,), with the fault in them; `chance` is used for shares below 1."""
        index = np.arange(len(codes))
        lost = (index >= self.start) & (index < self.stop)
        if self.share < 1:
            lost &= chance(f"missing {port.name} from {self.start} to {self.stop}").random(len(codes)) < self.share
        if self.code is not None:
            return np.where(lost, np.clip(self.code, port.lowest, port.highest), codes)
        last = np.maximum.accumulate(np.where(lost, -1, index))
        return np.where(last < 0, np.clip(0, port.lowest, port.highest), codes[np.maximum(last, 0)])


def with_faults(codes: Codes, port: Port, faults: Sequence[CodeFault], chance: Streams) -> Codes:
    """Codes, shape (n,), with one fault after another in them."""
    for fault in faults:
        codes = fault.applied(codes, port, chance)
    return codes
