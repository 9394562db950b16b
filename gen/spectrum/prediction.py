"""What signals hold, wanted and not, and what a filter makes of it by its response and their spectra."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy import signal

from sosmith.gen.filter.design import Filter
from sosmith.gen.spectrum.spectra import Array, Spectrum


@dataclass(frozen=True, eq=False, kw_only=True)
class Content:
    """What one signal holds: what is wanted of it, and what disturbs.

    Attributes
    ----------
    name : str
        File and signal.
    wanted : Spectrum or None
        Of what is to pass; None for motion, of which nothing is wanted.
    disturbance : Spectrum
        Of what is not.
    has_truth : bool
        Whether the two were told apart by a true signal, not by frequency.
    slow : float
        Rms of the disturbance that is slower than the spectra resolve; it counts as let through.
    """

    name: str
    wanted: Spectrum | None
    disturbance: Spectrum
    has_truth: bool
    slow: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """Error at the filter's output by its response and the spectra of one signal, in the signal's unit.

    Attributes
    ----------
    name : str
        File and signal.
    wanted : float
        Rms of what the filter does to the wanted signal, its delay at zero frequency set aside.
    disturbance : float
        Rms of what is left of the disturbance.
    slow : float
        Rms of the disturbance that is slower than the spectra resolve, taken as left.
    unfiltered : float
        Rms of the disturbance before the filter.
    """

    name: str
    wanted: float
    disturbance: float
    slow: float
    unfiltered: float

    @property
    def rms(self) -> float:
        """Of all three, taken as uncorrelated."""
        return math.hypot(self.wanted, self.disturbance, self.slow)


def told_apart(name: str, measured: Spectrum, passband: float) -> Content:
    """Content of a measured signal without truth: all up to `passband` in Hz is wanted, all above disturbs."""
    below = measured.frequency <= passband
    wanted = replace(measured, density=np.where(below, measured.density, 0.0))
    disturbance = replace(measured, density=np.where(below, 0.0, measured.density))
    return Content(name=name, wanted=wanted, disturbance=disturbance, has_truth=False)


def band_rms(spectrum: Spectrum, first: int, last: int | None = None) -> float:
    """Root mean square of the frequencies of index `first` up to, not with, `last`; never with zero frequency."""
    return float(np.sqrt(np.sum(spectrum.density[max(first, 1) : last]) * spectrum.step))


def response(made: Filter, frequency: Array) -> npt.NDArray[np.complex128]:
    """Frequency response of a filter at `frequency` in Hz, shape (n,)."""
    _, values = signal.sosfreqz(made.sos, worN=2 * np.pi * frequency / made.sample_rate)
    return np.asarray(values, dtype=np.complex128)


def predict(content: Content, made: Filter, delay: float) -> Prediction:
    """Integrate what the response makes of the spectra; the wanted signal is held against itself, delayed."""

    def rms(spectrum: Spectrum | None, delayed: bool) -> float:
        if spectrum is None:
            return 0.0
        gain = response(made, spectrum.frequency)
        if delayed:
            gain = gain * np.exp(2j * np.pi * spectrum.frequency * delay) - 1
        return band_rms(replace(spectrum, density=spectrum.density * np.abs(gain) ** 2), 0)

    return Prediction(
        name=content.name,
        wanted=rms(content.wanted, delayed=True),
        disturbance=rms(content.disturbance, delayed=False),
        slow=content.slow,
        unfiltered=content.disturbance.rms,
    )
