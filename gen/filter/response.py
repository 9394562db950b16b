"""Frequency response of second-order sections and FIR filters: magnitude, group delay, passband and stopband measures.

All results are computed section by section from the section's polynomials and then added, in dB and in samples. No
phase is differentiated or unwrapped, so poles very close to z = 1 (cut-off far below the sampling frequency) cause no
loss of accuracy.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import cast

import numpy as np
import numpy.typing as npt
from flint import acb, fmpq, fmpq_poly

from sosmith.gen.specification.choices import KINDS
from sosmith.model.arithmetic.elementary import geometric, log10

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
Band = tuple[float, float]

FLOOR_DB = -400.0
"""Lower limit of magnitudes; anything lower, such as at a zero on the unit circle, is shown as this."""

MASK_TOLERANCE_DB = 1e-3
"""How far a response may miss its mask. A minimum-order design meets one edge of the mask exactly, so rounded
coefficients may miss it slightly."""

HALF_POWER_DB = 10 * math.log10(2)


@dataclass(frozen=True, kw_only=True)
class FilterFacts:
    """A filter as specified and as realized by its integer coefficients.

    Attributes
    ----------
    sample_rate : float
        Sampling frequency of one channel in Hz.
    ideal_sos, quantized_sos : ndarray, shape (n_sections, 2 * (order + 1))
        Rows ``[b0, b1, b2, a0, a1, a2]`` with scipy's signs, ``a0 != 0``, or of an FIR filter its taps and as many of
        1, 0, 0, ...; the second holds the integer coefficients of the hardware as numbers. The order of the rows may
        differ between the two.
    kind : str
        ``"lowpass"``, ``"highpass"``, ``"bandpass"`` or ``"bandstop"``.
    passband_edge, stopband_edge : tuple of float or None
        Edges of the specification's mask in Hz: one for low-pass and high-pass, else two in rising order.
    passband_loss, stopband_loss : float or None
        Largest loss in the passband and smallest in the stopband, in dB, both positive.
    cutoff : tuple of float or None
        Cut-off frequencies in Hz, as many as edges.
    cutoff_of_stopband : bool
        Whether the stopband begins at the cut-off, as that of a Chebyshev filter of the second kind, and the passband
        somewhere before it.
    """

    sample_rate: float
    ideal_sos: Array
    quantized_sos: Array
    kind: str = "lowpass"
    passband_edge: tuple[float, ...] | None = None
    stopband_edge: tuple[float, ...] | None = None
    passband_loss: float | None = None
    stopband_loss: float | None = None
    cutoff: tuple[float, ...] | None = None
    cutoff_of_stopband: bool = False

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"kind must be one of {', '.join(KINDS)}, not {self.kind!r}")
        count = 1 if self.kind in ("lowpass", "highpass") else 2
        for name in ("passband_edge", "stopband_edge", "cutoff"):
            edges = getattr(self, name)
            if edges is not None and len(edges) != count:
                raise ValueError(f"{name} of a {self.kind} must hold {count} frequencies, not {edges!r}")
        for name in ("ideal_sos", "quantized_sos"):
            shape = np.shape(getattr(self, name))
            if len(shape) != 2 or shape[0] < 1 or shape[1] < 6 or shape[1] % 2:
                raise ValueError(f"{name} must have the shape (n_sections, 6) or that of an FIR filter, not {shape!r}")


@dataclass(frozen=True, kw_only=True)
class ResponseMeasures:
    """Comparison of the quantized response with the ideal one and with the mask.

    Attributes
    ----------
    max_deviation_db_passband : float
        Largest ``|quantized - ideal|`` in the passband, in dB.
    stopband_attenuation_db : float or None
        Smallest attenuation of the quantized response in the stopband, in dB below the passband's level;
        None where no stopband is known.
    passband_loss_db : float
        Largest loss of the quantized response in the passband, in dB below the passband's level.
    passband_gain_db : float
        Largest gain of the quantized response in the passband, in dB above the passband's level.
    largest_pole_radius : float
        Largest pole radius of the quantized filter; below 1 if and only if it is stable.
    """

    max_deviation_db_passband: float
    stopband_attenuation_db: float | None
    passband_loss_db: float
    passband_gain_db: float
    largest_pole_radius: float


def halves(row: Array) -> tuple[Array, Array]:
    """Return numerator and denominator of a section."""
    taps = len(row) // 2
    return row[:taps], row[taps:]


def _polynomial(coefficients: Array, omega: Array) -> tuple[Array, Array]:
    """Real and imaginary part of ``c0 + c1 z^-1 + c2 z^-2 + ..`` on the unit circle."""
    return _at(coefficients, np.cos(omega), np.sin(omega))


def _at(coefficients: Array, cos: Array, sin: Array) -> tuple[Array, Array]:
    """Do the same from cosine and sine of the angles.

    Complex numbers are avoided, because numpy's complex products differ among machines.
    """
    *others, before, last = (float(c) for c in coefficients)
    real, imag = before + last * cos, -last * sin
    for c in others[::-1]:
        real, imag = c + cos * real + sin * imag, cos * imag - sin * real
    return real, imag


def _polynomial_delay(coefficients: Array, omega: Array) -> Array:
    """Group delay of ``c0 + c1 z^-1 + c2 z^-2 + ..`` in samples; NaN where the polynomial vanishes.

    The delay is ``Re(sum k c_k z^-k / sum c_k z^-k)``. (Anti)symmetric polynomials have linear phase, half
    their degree in samples, also on the unit circle's zeros where the quotient is 0/0.
    """
    c = np.trim_zeros(coefficients, "b")
    if len(c) and (np.array_equal(c, c[::-1]) or np.array_equal(c, -c[::-1])):
        return np.full(omega.shape, (len(c) - 1) / 2)
    real, imag = _polynomial(coefficients, omega)
    vanishes = np.hypot(real, imag) < 1e-13 * np.sum(np.abs(coefficients))
    slope_real, slope_imag = _polynomial(coefficients * np.arange(len(coefficients)), omega)
    square = np.where(vanishes, 1.0, real * real + imag * imag)
    return np.where(vanishes, np.nan, (slope_real * real + slope_imag * imag) / square)


def magnitude_db(sos: Array, frequency: Array, sample_rate: float) -> Array:
    """Magnitude response in dB, not below `FLOOR_DB`.

    Parameters
    ----------
    sos : ndarray, shape (n_sections, 2 * (order + 1))
        Sections with scipy's signs.
    frequency : ndarray, shape (n,)
        Frequencies in Hz.
    sample_rate : float
        Sampling frequency in Hz.
    """
    omega = 2 * np.pi * frequency / sample_rate
    total = np.zeros(omega.shape)
    cos, sin = np.cos(omega), np.sin(omega)
    tiny = 10 ** (FLOOR_DB / 20)
    for section in sos:
        numerator, denominator = (np.hypot(*_at(half, cos, sin)) for half in halves(section))
        total += 20 * log10(np.maximum(numerator, tiny) / np.maximum(denominator, tiny))
    return np.maximum(total, FLOOR_DB)


def complex_response(sos: Array, frequency: Array, sample_rate: float) -> Complex:
    """Complex frequency response; parameters as for `magnitude_db`, `frequency` of any shape."""
    omega = 2 * np.pi * frequency / sample_rate
    total = np.ones(omega.shape, dtype=np.complex128)
    for section in sos:
        (over_real, over_imaginary), (under_real, under_imaginary) = (_polynomial(h, omega) for h in halves(section))
        total *= (over_real + 1j * over_imaginary) / (under_real + 1j * under_imaginary)
    return total


def group_delay(sos: Array, frequency: Array, sample_rate: float) -> Array:
    """Group delay in s, NaN where the response vanishes; parameters as for `magnitude_db`.

    Examples
    --------
    The average of three neighbours, weighted 1 : 2 : 1, delays by one sample.

    >>> group_delay(np.array([[0.25, 0.5, 0.25, 1.0, 0.0, 0.0]]), np.array([0.0, 10.0]), 100.0).tolist()
    [0.01, 0.01]
    """
    omega = 2 * np.pi * frequency / sample_rate
    total = np.zeros(omega.shape)
    for section in sos:
        over, under = halves(section)
        total += _polynomial_delay(over, omega) - _polynomial_delay(under, omega)
    return total / sample_rate


def _roots(polynomials: Array) -> Complex:
    """Roots of the rows ``c0 + c1 z^-1 + c2 z^-2 + ..`` in z, without those at the origin and at infinity."""
    roots = [root for row in polynomials.tolist() for root in _roots_of(np.trim_zeros(np.array(row)).tolist())]
    return np.array(roots, dtype=np.complex128)


def _roots_of(coefficients: Sequence[float]) -> list[complex]:
    """Roots of a polynomial with the highest power first."""
    if len(coefficients) <= 3:
        return _quadratic_roots(coefficients)
    # Isolated by the library, and the same on every machine, which eigenvalues are not.
    exact = fmpq_poly([fmpq(*c.as_integer_ratio()) for c in coefficients[::-1]])
    roots = cast("list[tuple[acb, int]]", exact.numer().complex_roots())  # its type stubs omit the multiplicities
    return [complex(root) for root, count in roots for _ in range(count)]


def _quadratic_roots(coefficients: Sequence[float]) -> list[complex]:
    """Roots of ``c0 z^2 + c1 z + c2`` or ``c0 z + c1``, the larger of two real ones first."""
    if len(coefficients) < 3:
        return [complex(-c1 / coefficients[0]) for c1 in coefficients[1:]]
    c0, c1, c2 = coefficients
    # exact, because nearly equal roots are separated by it
    square = float(Fraction(c1) ** 2 - 4 * Fraction(c0) * Fraction(c2))
    if square < 0:
        real, imag = -c1 / (2 * c0), math.sqrt(-square) / abs(2 * c0)
        return [complex(real, imag), complex(real, -imag)]
    far = -(c1 + math.copysign(math.sqrt(square), c1)) / 2
    return [complex(far / c0), complex(c2 / far)]


def poles(sos: Array) -> Complex:
    """Poles of all sections, without those at the origin."""
    return _roots(sos[:, sos.shape[1] // 2 :])


def zeros(sos: Array) -> Complex:
    """Zeros of all sections, without those at the origin and at infinity."""
    return _roots(sos[:, : sos.shape[1] // 2])


def frequency_grid(facts: FilterFacts, points: int = 1200) -> Array:
    """Frequencies in Hz from 1/100 of the lowest edge to Nyquist, logarithmic, edges included."""
    nyquist = facts.sample_rate / 2
    edges = [f for pair in (facts.passband_edge, facts.stopband_edge, facts.cutoff) if pair for f in pair]
    lowest = min(edges) if edges else _lowest_pole_frequency(facts)
    start = min(lowest, nyquist / 2) / 100
    grid = geometric(start, nyquist, points)
    return np.unique(np.concatenate([grid, [f for f in edges if f < nyquist]]))


def _lowest_pole_frequency(facts: FilterFacts) -> float:
    """Distance of the nearest pole from z = 1, as a frequency in Hz: where the response starts to fall."""
    offsets = poles(facts.ideal_sos) - 1
    distances = np.hypot(offsets.real, offsets.imag)
    distance = float(np.min(distances)) if len(distances) else 1.0
    return max(distance, 1e-9) * facts.sample_rate / (2 * np.pi)


def _outside(edges: tuple[float, ...], kind: str, nyquist: float, *, stop: bool) -> list[Band]:
    """Bands on the passing (or stopping) side of `edges`."""
    low, high = edges[0], edges[-1]
    if kind in ("lowpass", "highpass"):
        return [(0.0, low)] if (kind == "lowpass") != stop else [(low, nyquist)]
    return [(low, high)] if (kind == "bandpass") != stop else [(0.0, low), (high, nyquist)]


def passbands(facts: FilterFacts) -> list[Band]:
    """Passbands in Hz: from the passband edges if given, else from the cut-off, else empty.

    Where the cut-off is that of the stopband, they reach as far as the ideal response stays within 3.01 dB of its peak.
    """
    if facts.cutoff_of_stopband and facts.passband_edge is None:
        return _half_power_bands(facts)
    edges = facts.passband_edge or facts.cutoff
    return _outside(edges, facts.kind, facts.sample_rate / 2, stop=False) if edges else []


def _half_power_bands(facts: FilterFacts) -> list[Band]:
    """Return stretches of the grid in which the ideal response stays within 3.01 dB of its peak."""
    grid = _grid(facts)
    ideal = magnitude_db(facts.ideal_sos, grid, facts.sample_rate)
    inside = np.concatenate([[False], ideal >= float(np.max(ideal)) - HALF_POWER_DB, [False]])
    starts, ends = np.flatnonzero(inside[1:] & ~inside[:-1]), np.flatnonzero(inside[:-1] & ~inside[1:]) - 1
    return [(float(grid[a]), float(grid[b])) for a, b in zip(starts, ends, strict=True)]


def stopbands(facts: FilterFacts) -> list[Band]:
    """Stopbands in Hz: from the stopband edges if given, or the cut-off that is theirs, else from an octave beyond it.

    If an octave does not fit, they start half-way to the Nyquist frequency, or are the middle half of a band-stop.
    """
    nyquist = facts.sample_rate / 2
    known = facts.stopband_edge or (facts.cutoff if facts.cutoff_of_stopband else None)
    if known:
        return _outside(known, facts.kind, nyquist, stop=True)
    if not facts.cutoff:
        return []
    low, high = facts.cutoff[0], facts.cutoff[-1]
    above, below = min(2 * high, (high + nyquist) / 2), low / 2
    quarter = (high - low) / 4
    edges = {
        "lowpass": (above,),
        "highpass": (below,),
        "bandpass": (below, above),
        "bandstop": (low + quarter, high - quarter),
    }[facts.kind]
    return _outside(edges, facts.kind, nyquist, stop=True)


def _within(frequency: Array, bands: list[Band]) -> npt.NDArray[np.bool_]:
    inside = np.zeros(frequency.shape, dtype=bool)
    for low, high in bands:
        inside |= (frequency >= low) & (frequency <= high)
    return inside


def measurement_grid(facts: FilterFacts) -> Array:
    """Frequencies in Hz for the measures: DC, the logarithmic grid, an even grid, and all band edges."""
    nyquist = facts.sample_rate / 2
    edges = [f for band in passbands(facts) + stopbands(facts) for f in band]
    return np.unique(np.concatenate([_grid(facts), np.clip(edges, 0, nyquist)]))


def _grid(facts: FilterFacts) -> Array:
    even = np.linspace(0, facts.sample_rate / 2, 4001)
    return np.unique(np.concatenate([even, frequency_grid(facts, 4000)]))


def passband_level_db(facts: FilterFacts) -> float:
    """Largest gain of the ideal response in dB in the passband, or anywhere if no passband is known."""
    grid = measurement_grid(facts)
    return _level(magnitude_db(facts.ideal_sos, grid, facts.sample_rate), _within(grid, passbands(facts)))


def _level(ideal: Array, inside: npt.NDArray[np.bool_]) -> float:
    return float(np.max(ideal[inside] if inside.any() else ideal))


def measure_response(facts: FilterFacts) -> ResponseMeasures:
    """Compare the quantized response with the ideal one in the passband and the stopband.

    The passband reaches to the passband edges, else to the cut-off, else as far as the ideal response stays
    within 3.01 dB of its peak. For the stopband see `stopbands`. Levels are relative to the largest gain of
    the ideal response in the passband.
    """
    grid = measurement_grid(facts)
    ideal = magnitude_db(facts.ideal_sos, grid, facts.sample_rate)
    quantized = magnitude_db(facts.quantized_sos, grid, facts.sample_rate)
    inside = _within(grid, passbands(facts))
    level = _level(ideal, inside)
    if not passbands(facts):
        inside = ideal >= level - HALF_POWER_DB
    stop = _within(grid, stopbands(facts))
    quantized_poles: list[complex] = poles(facts.quantized_sos).tolist()
    return ResponseMeasures(
        max_deviation_db_passband=float(np.max(np.abs(quantized - ideal)[inside])),
        stopband_attenuation_db=float(level - np.max(quantized[stop])) if stop.any() else None,
        passband_loss_db=float(level - np.min(quantized[inside])),
        passband_gain_db=float(np.max(quantized[inside]) - level),
        largest_pole_radius=max((math.hypot(pole.real, pole.imag) for pole in quantized_poles), default=0.0),
    )
