"""Impulse-invariant filters: ``h[n] = T h_a(n T)`` of an analog low-pass, as second-order sections.

With the analog filter in partial fractions (simple poles, more poles than zeros) [1]_::

    H_a(s) = sum of R_i / (s - p_i)   ->   H(z) = T * sum of R_i / (1 - exp(p_i T) z^-1)

What the analog filter passes above half the sample rate folds back: `Aliasing` says how much.

The zeros of H(z) are nearly those of Euler's polynomials, and at low cutoffs the sum is by many orders of magnitude
smaller than its terms. Hence residues, numerator and zeros are computed in ball arithmetic; only the sections'
coefficients are rounded to double precision.

References
----------
.. [1] A. V. Oppenheim and R. W. Schafer, Discrete-Time Signal Processing, "Filter design by impulse invariance".
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from flint import acb, acb_poly, arb, ctx
from scipy import signal

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

_PRECISION = 1024
"""Bits: order 20 at a millionth of the sample rate takes some 400."""

_TOLERANCE = 2.0**-200  # of the zeros, relative

_GRID = 4096  # frequencies at which responses are compared


@dataclass(frozen=True, kw_only=True)
class Aliasing:
    """How far an impulse-invariant filter is from its analog model, up to half the sample rate.

    Attributes
    ----------
    max_deviation : float
        Largest difference of the two magnitudes, as a part of the analog filter's largest.
    dc_error : float
        Gain at zero frequency minus the analog filter's, as a part of the latter.
    """

    max_deviation: float
    dc_error: float


@dataclass(frozen=True, kw_only=True)
class AnalogFilter:
    """Zeros, poles (rad/s) and gain: ``gain * prod(s - zeros) / prod(s - poles)``."""

    zeros: Complex
    poles: Complex
    gain: float


def analog_lowpass(
    family: str, order: int, cutoff: float, passband_loss: float | None, stopband_loss: float | None
) -> AnalogFilter:
    """Analog low-pass of a family with its edge at `cutoff` Hz, not pre-warped; losses in dB where it needs them."""
    edge = 2 * np.pi * cutoff
    make: dict[str, Callable[[], tuple[Complex, Complex, float]]] = {
        "butterworth": lambda: signal.butter(order, edge, analog=True, output="zpk"),
        "chebyshev1": lambda: signal.cheby1(order, passband_loss, edge, analog=True, output="zpk"),
        "chebyshev2": lambda: signal.cheby2(order, stopband_loss, edge, analog=True, output="zpk"),
        "elliptic": lambda: signal.ellip(order, passband_loss, stopband_loss, edge, analog=True, output="zpk"),
        "bessel": lambda: signal.bessel(order, edge, analog=True, output="zpk", norm="mag"),
    }
    zeros, poles, gain = make[family]()
    return AnalogFilter(zeros=np.asarray(zeros), poles=np.asarray(poles), gain=float(gain))


def impulse_invariant(analog: AnalogFilter, sample_rate: float) -> tuple[Array, Aliasing]:
    """Sections of the filter that samples the impulse response of `analog`.

    Parameters
    ----------
    analog : AnalogFilter
        More poles than zeros; poles simple, in the left half-plane, at most one of them real.
    sample_rate : float
        Hz.

    Returns
    -------
    sos : ndarray, shape (sections, 6)
        Poles closest to the unit circle last, as scipy has them. Each section has unity gain at zero frequency,
        except that the first takes what is left of the gain.
    aliasing : Aliasing

    Raises
    ------
    ValueError
        If there are not more poles than zeros.
    """
    if len(analog.zeros) >= len(analog.poles):
        raise ValueError(f"zeros must be fewer than the {len(analog.poles)} poles, not {len(analog.zeros)}")
    with ctx.workprec(_PRECISION):
        sos = _sections(analog, sample_rate)
    return sos, _aliasing(analog, sos, sample_rate)


def _sections(analog: AnalogFilter, sample_rate: float) -> Array:
    poles = [(acb(p) / sample_rate).exp() for p in analog.poles]
    numerator = _numerator(analog, poles, sample_rate)
    single = [acb_poly([1, -pole.real]) for pole, p in zip(poles, analog.poles, strict=True) if p.imag == 0]
    pairs = [pole for pole, p in zip(poles, analog.poles, strict=True) if p.imag > 0]
    groups = _zero_groups(numerator, delayed=len(analog.poles) - len(analog.zeros) > 1)
    matched = []
    for pole in sorted(pairs, key=lambda pole: -float(abs(pole))):
        groups.sort(key=lambda zeros: min((float(abs(zero - pole)) for zero in zeros[1]), default=np.inf))
        matched.append((groups.pop(0)[0], acb_poly([1, -2 * pole.real, abs(pole) ** 2])))
    cascade = [*((acb_poly([1]), denominator) for denominator in single), *matched[::-1]]
    total = numerator(1) / _product([denominator for _, denominator in cascade])(1)
    rows: list[list[float]] = []
    for zeros, denominator in cascade:
        gain = denominator(1) / zeros(1) * (total if not rows else 1)
        rows.append([*_doubles(zeros * gain), *_doubles(denominator)])
    return np.array(rows)


def _numerator(analog: AnalogFilter, poles: Sequence[acb], sample_rate: float) -> acb_poly:
    """Numerator of H in ``w = z**-1``, of one degree less than there are poles."""
    total = acb_poly([])
    for i, pole in enumerate(analog.poles):
        residue = acb(analog.gain)
        for zero in analog.zeros:
            residue *= acb(pole) - acb(zero)
        for j, other in enumerate(analog.poles):
            if j != i:
                residue /= acb(pole) - acb(other)
        others = [acb_poly([1, -digital]) for j, digital in enumerate(poles) if j != i]
        total += _product(others) * (residue / sample_rate)
    return acb_poly([total[k].real for k in range(len(poles))])


def _product(polynomials: Sequence[acb_poly]) -> acb_poly:
    result = acb_poly([1])
    for polynomial in polynomials:
        result *= polynomial
    return result


_Group = tuple[acb_poly, list[acb]]
"""A polynomial in w, and its zeros in the plane of z."""


def _zero_groups(numerator: acb_poly, *, delayed: bool) -> list[_Group]:
    """Factors of degree 2, and one of a lower degree if need be, up to a constant.

    Real zeros lie in nearly reciprocal pairs; the outermost go together, which balances their coefficients. Where
    the analog impulse response starts at zero, so that the filter has one sample of delay, this goes with what is
    left over.
    """
    constant = 1 if delayed else 0
    rest = acb_poly([numerator[k] for k in range(constant, numerator.degree() + 1)])
    zeros = [1 / root for root in rest.roots(tol=_TOLERANCE, maxprec=_PRECISION)]
    real = sorted((zero for zero in zeros if zero.imag.contains(0)), key=lambda zero: float(abs(zero)))
    groups: list[_Group] = [(acb_poly([1, -2 * zero.real, abs(zero) ** 2]), [zero]) for zero in zeros if zero.imag > 0]
    while len(real) > 1:
        first, last = real.pop(0), real.pop()
        groups.append((acb_poly([1, -first.real]) * acb_poly([1, -last.real]), [first, last]))
    left_over = _product([acb_poly([1, -zero.real]) for zero in real])
    if delayed or real:
        groups.append((left_over * acb_poly([0, 1]) if delayed else left_over, real))
    return groups


def _doubles(polynomial: acb_poly) -> list[float]:
    coefficients: list[arb] = [polynomial[k].real for k in range(3)]
    return [float(coefficient.mid()) for coefficient in coefficients]


def _aliasing(analog: AnalogFilter, sos: Array, sample_rate: float) -> Aliasing:
    slow = float(np.abs(analog.poles).min()) / 2 / np.pi
    linear = np.linspace(0, sample_rate / 2, _GRID)
    frequencies = np.union1d(linear, np.geomspace(min(slow, sample_rate / 2) / 100, sample_rate / 2, _GRID))
    model = np.abs(_analog_response(analog, frequencies))
    made = np.abs(signal.sosfreqz(sos, worN=frequencies, fs=sample_rate)[1])
    return Aliasing(
        max_deviation=float(np.abs(made - model).max() / model.max()),
        dc_error=float(made[0] / model[0] - 1),
    )


def _analog_response(analog: AnalogFilter, frequencies: Array) -> Complex:
    return np.asarray(
        signal.freqs_zpk(analog.zeros, analog.poles, analog.gain, worN=2 * np.pi * frequencies)[1], dtype=np.complex128
    )
