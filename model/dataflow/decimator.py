"""The decimator before a filter: a cascaded integrator-comb (CIC) filter in integers, and one rounding behind it.

N integrators run at the rate of the input, N combs at a rate R times lower::

    x --> [+ z^-1] --> .. N .. --> every R-th --> [1 - z^-1] --> .. N .. --> round --> y

Together they are the moving sum ``((1 - z**-R) / (1 - z**-1))**N`` of R samples, N times over, taken at every R-th
sample (E. B. Hogenauer, "An economical class of digital filters for decimation and interpolation", 1981). All its
coefficients are positive and add up to ``R**N``, so that its output lies within that many times the range of the input:
it needs ``N log2 R`` bits more. The integrators overflow, which does not matter: everything up to the rounding is
computed modulo ``2**width``, and a result that fits `width` bits is exact.

The first result belongs to the first sample, as if that had been there for ever, or the code 0 with a start from zero;
result n belongs to sample ``n R``.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Codes, Values
from sosmith.model.dataflow.cic import impulse_response
from sosmith.model.dataflow.downsampler import gathered
from sosmith.model.port import Port

_Flags = TypeVar("_Flags", np.bool_, np.uint8)

MAX_WIDTH = 63
"""Widest register of a decimator, in bits: the models in software have words of 64."""


@dataclass(frozen=True, kw_only=True)
class Decimator:
    """A CIC filter that takes every R-th sample.

    Attributes
    ----------
    input : Port
        What enters, at the higher rate.
    factor : int
        R, a power of two from 2 on.
    stages : int
        N, from 1 on: pairs of an integrator and a comb.
    dropped : int
        Bits that the rounding to nearest (halves upward) behind the last comb drops, 0 to `growth`.
    steady : bool
        Whether the first sample counts as if it had been there for ever, and not the code 0.

    Examples
    --------
    >>> port = Port(name="x", bits=8, signed=True, lsb=Fraction(1), zero=Fraction(0))
    >>> cic = Decimator(input=port, factor=2, stages=2, dropped=0)
    >>> cic.width, cic.impulse_response
    (10, (1, 2, 1))
    >>> cic.compute(np.array([5, 5, 7, 8, 8])).tolist()
    [20, 22, 31]
    """

    input: Port
    factor: int
    stages: int
    dropped: int
    steady: bool = True

    def __post_init__(self) -> None:
        if self.factor < 2 or self.factor & (self.factor - 1):
            raise ValueError(f"factor must be a power of two from 2 on, not {self.factor}")
        if self.stages < 1:
            raise ValueError(f"stages must be at least 1, not {self.stages}")
        if not 0 <= self.dropped <= self.growth:
            raise ValueError(f"dropped must be in 0..{self.growth}, not {self.dropped}")
        if self.width > MAX_WIDTH:
            raise ValueError(f"width must be at most {MAX_WIDTH} bits, not {self.width}")

    @property
    def growth(self) -> int:
        """Bits by which the output is wider than the input: ``log2(R**N)``."""
        return self.stages * (self.factor.bit_length() - 1)

    @property
    def width(self) -> int:
        """Bits of each integrator and comb, in which every output is exact."""
        return self.input.bits + self.growth

    @property
    def register_bits(self) -> int:
        """Bits of what the hardware keeps: a sum for each integrator, and for each comb what was before and is now."""
        return 3 * self.stages * self.width + self.width - self.dropped

    @property
    def adder_bits(self) -> int:
        """Result bits of its sums and differences, the rounding among them."""
        return 2 * self.stages * self.width + (self.width if self.dropped else 0)

    @property
    def bits_of_channel(self) -> int:
        """Bits that hardware for several channels keeps of each in memories: all sums, first sample, and phase."""
        return 2 * self.stages * self.width + (self.input.bits if self.steady else 0) + self.factor.bit_length()

    @property
    def lsb(self) -> Fraction:
        """Physical value of one LSB of the output."""
        return self.input.lsb * Fraction(2) ** (self.dropped - self.growth)

    @property
    def output(self) -> Port:
        """What leaves, at the lower rate: the same quantity with a finer LSB."""
        return Port(
            name=self.input.name,
            bits=self.width - self.dropped,
            signed=self.input.signed,
            lsb=self.lsb,
            zero=self.input.zero,
            unit=self.input.unit,
        )

    @property
    def rounding(self) -> Fraction:
        """Bound on the error of the rounding, in the input's unit."""
        return self.lsb / 2 if self.dropped else Fraction(0)

    @property
    def impulse_response(self) -> tuple[int, ...]:
        """Response at the higher rate; the sum of its samples is ``R**N``."""
        return impulse_response(self.factor, self.stages)

    def before(self, response: Values) -> Values:
        """Return the response of decimator and filter, at the higher rate, from the filter's own.

        Parameters
        ----------
        response : float array, shape (n,)
            Impulse response at the lower rate.

        Returns
        -------
        float array
            What the input's samples, the latest first, contribute to a result.
        """
        spread = np.zeros(len(response) * self.factor)
        spread[:: self.factor] = response
        for _ in range(self.stages):
            sums = np.concatenate([np.zeros(self.factor), np.cumsum(np.pad(spread, (0, self.factor - 1)))])
            spread = (sums[self.factor :] - sums[: -self.factor]) / self.factor
        return spread

    @property
    def warm_up(self) -> int:
        """Times that the first sample goes in before it counts: then it has been there for ever. 0 from zero."""
        return self.stages * self.factor if self.steady else 0

    @property
    def remembered(self) -> int:
        """Results after a start that depend on what was before: as many as samples before them reach into."""
        return self.stages - self.stages // self.factor

    def count(self, samples: int) -> int:
        """Count the results of so many samples."""
        return -(-samples // self.factor)

    def exact(self, codes: Codes) -> Codes:
        """Return the results before the rounding: the code of `input` times ``R**N``.

        Parameters
        ----------
        codes : int64 array, shape (samples,)
            Codes of the input.

        Returns
        -------
        int64 array, shape (count(samples),)
        """
        if not len(codes):
            return np.zeros(0, dtype=np.int64)
        # The arithmetic of unsigned words is modulo 2**64, a multiple of 2**width.
        before = np.repeat(codes[:1] if self.steady else 0, self.stages * self.factor)
        values = np.concatenate([before, codes]).astype(np.int64).view(np.uint64)
        for _ in range(self.stages):
            values = np.cumsum(values, dtype=np.uint64)
        values = values[:: self.factor]
        for _ in range(self.stages):
            values = values[1:] - values[:-1]
        return values.view(np.int64)

    def compute(self, codes: Codes) -> Codes:
        """Return the codes of `output` for codes of `input`; shapes as for `exact`."""
        exact = self.exact(codes)
        return (exact + (1 << self.dropped >> 1)) >> self.dropped

    def at_rail(self, codes: Codes) -> npt.NDArray[np.bool_]:
        """Whether any sample since the result before was the lowest or the highest code, for each result."""
        return self.gathered((codes == self.input.lowest) | (codes == self.input.highest))

    def gathered(self, flags: npt.NDArray[_Flags]) -> npt.NDArray[_Flags]:
        """Return, for each result, the bits set in any sample since the result before.

        Parameters
        ----------
        flags : array of bool or of an integer type, shape (samples,)
        """
        return gathered(flags, self.factor)
