"""What a file with a filter holds: second-order sections, a transfer function, or zeros and poles."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

Signs = Literal["scipy", "negated"]
"""Convention of a1 and a2: that of scipy, ``1 + a1/z + a2/z**2`` in the denominator, or both with the other sign."""

Row = tuple[Fraction, ...]
"""(b0, b1, b2, a0, a1, a2)."""

Complex = tuple[Fraction, Fraction]
"""Real and imaginary part."""


@dataclass(frozen=True, kw_only=True)
class StatedSections:
    """Second-order sections as they stand in a file.

    Attributes
    ----------
    format : str
        What the file is, such as "MATLAB's SOS and G".
    rows : tuple of Row
        At least one; a file without a0 has it as 1.
    gains : tuple of Fraction
        Scale values: none, one for the whole filter, one for each section, or one more, for the output.
    signs : Signs
        The convention of the format.
    sample_rate : Fraction or None
        In Hz, if the file says so.
    """

    format: str
    rows: tuple[Row, ...]
    gains: tuple[Fraction, ...] = ()
    signs: Signs = "scipy"
    sample_rate: Fraction | None = None


@dataclass(frozen=True, kw_only=True)
class TransferFunction:
    """Polynomials in 1/z, as in ``scipy.signal.lfilter(b, a, x)``; `format` as for `StatedSections`."""

    format: str
    numerator: tuple[Fraction, ...]
    denominator: tuple[Fraction, ...]

    @property
    def taps(self) -> tuple[Fraction, ...] | None:
        """The coefficients of an FIR filter; None of a filter with poles."""
        first, *others = self.denominator
        if any(others) or not first:
            return None
        return tuple(value / first for value in self.numerator)


@dataclass(frozen=True, kw_only=True)
class ZerosAndPoles:
    """Zeros, poles and gain, digital or of an analog prototype.

    Attributes
    ----------
    format : str
        As for `StatedSections`.
    zeros, poles : tuple of Complex
        In the z-plane, or in rad/s if `analog`; complex ones in conjugate pairs.
    gain : Fraction
        Factor of the product of all ``(z - zero) / (z - pole)``, or the same in s.
    analog : bool
        Whether this is an analog prototype.
    method : str
        Of an analog prototype: "bilinear" or "impulse_invariant".
    prewarp : Fraction or None
        With "bilinear": the frequency in Hz that is mapped to itself; None for none, ``s = 2 fs (z - 1) / (z + 1)``.
    """

    format: str
    zeros: tuple[Complex, ...]
    poles: tuple[Complex, ...]
    gain: Fraction
    analog: bool = False
    method: str = "bilinear"
    prewarp: Fraction | None = None


Content = StatedSections | TransferFunction | ZerosAndPoles
