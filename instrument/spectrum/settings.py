"""Settings of spectra and of a proposal: window and segments, allowed error, passband edge."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sosmith.model.errors import SpecificationError

WINDOWS = ("hann", "hamming", "blackman", "blackmanharris", "flattop", "boxcar")
DETRENDS = ("linear", "constant", "none")

TOLERANCE = 0.1
"""Default of the allowed error at the output, mm; an assumption, about 1 % of the 9 mm of wear in the paper's
section 6."""

COVERAGE = 2.0
"""Multiple of the rms error that the tolerance has to cover: 95 % of normally distributed errors (JCGM 100:2008,
section 6.3.3)."""

PASSBAND_LOSS = 0.1
"""Maximum loss up to the passband edge, dB, even if the wanted signal allows more: section 4.1 of the paper."""

PARTS = 4
"""Number of parts of the error."""


@dataclass(frozen=True, kw_only=True)
class SpectrumSettings:
    """How spectra are estimated.

    Attributes
    ----------
    window : str
        One of `WINDOWS`. The Hann window at 50 % overlap wastes little of the data, and its side lobes fall fast.
    segment : float or None
        Length of a segment, s; None for an eighth of the signal.
    overlap : float
        Fraction of a segment that the next one overlaps, 0 to 0.95.
    detrend : str
        One of `DETRENDS`: the trend removed from each segment first. A low-pass filter with unity gain at zero
        frequency only delays a straight line, so the line does not matter for the mask.
    confidence : float
        Probability of the confidence interval, between 0 and 1.

    Raises
    ------
    SpecificationError
        If a value is outside these limits.
    """

    window: str = "hann"
    segment: float | None = None
    overlap: float = 0.5
    detrend: str = "linear"
    confidence: float = 0.95

    def __post_init__(self) -> None:
        if self.window not in WINDOWS:
            raise SpecificationError(f"window must be one of {', '.join(WINDOWS)}, not {self.window!r}")
        if self.detrend not in DETRENDS:
            raise SpecificationError(f"detrend must be one of {', '.join(DETRENDS)}, not {self.detrend!r}")
        if self.segment is not None and not 0 < self.segment < math.inf:
            raise SpecificationError(f"segment must be a positive number of seconds, not {self.segment:g}")
        if not 0 <= self.overlap <= 0.95:
            raise SpecificationError(f"overlap must be 0 to 0.95 of a segment, not {self.overlap:g}")
        if not 0 < self.confidence < 1:
            raise SpecificationError(f"confidence must be between 0 and 1, not {self.confidence:g}")


@dataclass(frozen=True, kw_only=True)
class Wish:
    """Requirements on the filter.

    Attributes
    ----------
    tolerance : float
        Allowed error at the output, in the unit of the signals, positive. It does not include the offset, which no
        filter removes, and the delay.
    coverage : float
        Multiple of the rms error that has to be within the tolerance, positive.
    passband : float or None
        Passband edge, Hz; None derives it from the spectra of the true signals.
    passband_loss : float or None
        Loss up to the passband edge, dB; None derives it from the amplitudes of the wanted signals.

    Raises
    ------
    SpecificationError
        If a value is outside these limits.
    """

    tolerance: float = TOLERANCE
    coverage: float = COVERAGE
    passband: float | None = None
    passband_loss: float | None = None

    def __post_init__(self) -> None:
        for name, value, unit in (
            ("tolerance", self.tolerance, ""),
            ("coverage", self.coverage, ""),
            ("passband", self.passband, " of Hz"),
            ("passband-loss", self.passband_loss, " of dB"),
        ):
            if value is not None and not 0 < value < math.inf:
                raise SpecificationError(f"{name} must be a positive number{unit}, not {value:g}")

    @property
    def share(self) -> float:
        """Rms error allowed for each of the four parts."""
        return self.tolerance / (self.coverage * math.sqrt(PARTS))
