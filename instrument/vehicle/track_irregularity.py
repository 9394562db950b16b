"""Random track irregularities: a published power spectral density, and random profiles synthesized from it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline

from sosmith.instrument.vehicle.linear_motion import Array
from sosmith.instrument.vehicle.parameters import IrregularityTable

POINTS = 16
"""Points of a profile per shortest wavelength; the error of its cubic spline is then about 1e-4 of the amplitude."""


@dataclass(frozen=True, kw_only=True)
class Spectrum:
    """One-sided power spectral density S = A Oc^2 / ((O^2 + Or^2)(O^2 + Oc^2)) between two wavenumbers.

    The formula is that of the German spectra in ERRI B176 (Guo, Xia, De Roeck and Liu 2012, as quoted in the program
    TTB-2D, which also takes it as one-sided; Claus and Schiehlen 1997, from memory). With Or = 0 it is the American
    formula of the Federal Railroad Administration for level and alignment.

    Attributes
    ----------
    amplitude : float
        A in rad m.
    upper, lower : float
        Oc and Or in rad/m.
    band : pair of float
        Lowest and highest wavenumber in rad/m; the density is zero outside.
    """

    amplitude: float
    upper: float
    lower: float
    band: tuple[float, float]

    def density(self, wavenumber: Array) -> Array:
        """Return the density in m^2/(rad/m) at wavenumbers in rad/m."""
        squared = wavenumber**2
        value = self.amplitude * self.upper**2 / ((squared + self.lower**2) * (squared + self.upper**2))
        return np.asarray(np.where((wavenumber >= self.band[0]) & (wavenumber <= self.band[1]), value, 0.0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Profile:
    """A random profile over `distance`, continued periodically; it does not depend on speed or sample rate.

    Attributes
    ----------
    distance, height : ndarray, shape (n,)
        In m, equally spaced; the last point is the first of the next period.
    """

    distance: Array
    height: Array
    _spline: CubicSpline = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_spline", CubicSpline(self.distance, self.height, bc_type="periodic"))

    def at(self, distance: Array) -> Array:
        """Return the height in m."""
        return np.asarray(self._spline(distance))

    def slope_at(self, distance: Array) -> Array:
        """Return the slope of the height in m per m."""
        return np.asarray(self._spline(distance, 1))


@dataclass(frozen=True, kw_only=True, eq=False)
class Irregularity:
    """Alignment (lateral, positive to the left) and level (positive upward) of a track, each the mean of both rails."""

    alignment: Profile
    level: Profile


def spectra(table: IrregularityTable, level: str) -> tuple[Spectrum, Spectrum]:
    """Return the spectra of alignment and level for one of `LEVELS`."""
    band = 2 * math.pi / table.longest_wavelength, 2 * math.pi / table.shortest_wavelength
    amplitudes = {
        "low": (table.alignment_low, table.level_low),
        "high": (table.alignment_high, table.level_high),
    }[level]
    alignment, vertical = (
        Spectrum(amplitude=amplitude, upper=table.upper_wavenumber, lower=table.lower_wavenumber, band=band)
        for amplitude in amplitudes
    )
    return alignment, vertical


def synthesize(spectrum: Spectrum, length: float, generator: np.random.Generator) -> Profile:
    """Synthesize a profile of at least `length` m from harmonics of its period with random phases.

    The height is the sum of sqrt(2 S(O) dO) cos(O s + phase) over O = dO, 2 dO, ... (Shinozuka and Jan 1972, from
    memory), so its periodogram equals the density.
    """
    step = 2 * math.pi / spectrum.band[1] / POINTS
    count = 2 * math.ceil(length / step / 2)
    spacing = 2 * math.pi / (count * step)
    wavenumber = spacing * np.arange(count // 2 + 1, dtype=np.float64)
    phase = generator.uniform(0, 2 * math.pi, count // 2 + 1)
    amplitude = np.sqrt(2 * spectrum.density(wavenumber) * spacing)
    height = np.fft.irfft(amplitude * np.exp(1j * phase) * count / 2, count)
    return Profile(distance=step * np.arange(count + 1, dtype=np.float64), height=np.append(height, height[0]))


def irregularity(table: IrregularityTable, level: str, length: float, seed: int) -> Irregularity:
    """Synthesize both profiles for one of `LEVELS`: independent of each other, equal for equal seeds."""
    alignment, vertical = spectra(table, level)
    first, second = np.random.SeedSequence(seed).spawn(2)
    return Irregularity(
        alignment=synthesize(alignment, length, np.random.default_rng(first)),
        level=synthesize(vertical, length, np.random.default_rng(second)),
    )
