"""Filter design in double precision: from the specification to second-order sections.

Minimum order and cutoff of a Butterworth low-pass follow the paper's equations 10 to 13; poles, zeros and
their pairing come from scipy, or from `sosmith.gen.filter.impulse_invariance` where that method is asked for. Sign
convention of the sections: scipy's, ``a0 = 1``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy import signal

from sosmith.gen.filter.impulse_invariance import Aliasing, analog_lowpass, impulse_invariant
from sosmith.gen.specification.specification import FilterSpec
from sosmith.model.errors import ShortfallError, SpecificationError

Array = npt.NDArray[np.float64]

_MAX_RESPONSE = 1 << 24  # samples; poles closer to the unit circle than this resolves are refused
_DECAY = 1e-12  # where an impulse response counts as over, of its envelope
_COMFORTABLE = 20  # samples per period of the band edge: word lengths hardly fall with fewer
_SNAP = 1e-9  # relative distance at which a gain counts as one: rounding of the design, not intent
_SNAP_GIVEN = 1e-14  # the same for given sections, where only the products of their gains are rounded


@dataclass(frozen=True, kw_only=True)
class Filter:
    """A designed filter as a cascade of sections, each normalised to unity gain at one frequency.

    Attributes
    ----------
    sample_rate : float
        Hz.
    family, kind : str
        As in the specification; ``"sections"`` where the sections were given.
    order : int
        Number of poles.
    cutoff : tuple of float or None
        Hz, as the family defines it; None where the sections were given.
    passband_edge, stopband_edge : tuple of float or None
        Hz, where the specification states them.
    passband_loss, stopband_loss : float or None
        dB, likewise.
    rows : tuple of tuple of float
        (b0, b1, b2, 1, a1, a2) per section, in the order of the cascade.
    aliasing : Aliasing or None
        How far an impulse-invariant filter is from its analog model; None for every other.
    """

    sample_rate: float
    family: str
    kind: str
    order: int
    cutoff: tuple[float, ...] | None
    passband_edge: tuple[float, ...] | None
    stopband_edge: tuple[float, ...] | None
    passband_loss: float | None
    stopband_loss: float | None
    rows: tuple[tuple[float, ...], ...]
    aliasing: Aliasing | None = None

    @property
    def sos(self) -> Array:
        """Sections as scipy wants them, shape (sections, 6)."""
        return np.array(self.rows, dtype=np.float64)

    @cached_property
    def impulse_response(self) -> Array:
        """Impulse response, long enough that what follows is below 1e-12 of its envelope."""
        return impulse_response(self.sos)

    @property
    def dc_gain(self) -> float:
        """Gain at zero frequency."""
        sos = self.sos
        return float(np.prod(sos[:, :3].sum(axis=1) / sos[:, 3:].sum(axis=1)))

    @property
    def decimation(self) -> int:
        """Largest power of two to divide the sample rate by that leaves the upper band edge below a twentieth of it.

        1 if there is none, and where the filter passes all high frequencies or its cutoff is not known.
        """
        if self.cutoff is None or self.kind not in {"lowpass", "bandpass"}:
            return 1
        return 1 << max(0, math.floor(math.log2(self.sample_rate / (_COMFORTABLE * self.cutoff[-1]))))

    @property
    def describe(self) -> str:
        """One line for people: family, kind, order, cutoff, sample rate, and the method if it is not the usual one."""
        if self.cutoff is None:
            return f"{len(self.rows)} given sections at {self.sample_rate:g} Hz"
        edges = " to ".join(f"{edge:.6g}" for edge in self.cutoff)
        method = "" if self.aliasing is None else ", impulse-invariant"
        filter_ = f"{self.family.capitalize()} {self.kind}, order {self.order}"
        return f"{filter_}, {edges} Hz at {self.sample_rate:g} Hz{method}"


def impulse_response(sos: Array) -> Array:
    """Impulse response of `sos` until its envelope has decayed to 1e-12.

    Raises
    ------
    ShortfallError
        If that takes more than 2**24 samples.
    """
    length = decay_length(sos)
    impulse = np.zeros(length)
    impulse[0] = 1.0
    return np.asarray(signal.sosfilt(sos, impulse), dtype=np.float64)


def decay_length(sos: Array) -> int:
    """Count the samples after which the slowest mode has decayed to 1e-12, with a margin for repeated poles."""
    radius = max((float(abs(pole)) for row in sos for pole in np.roots([1.0, *row[4:]])), default=0.0)
    samples = 64.0 if radius < 1e-3 else 64 + 1.5 * math.log(_DECAY) / math.log(min(radius, 1 - 1e-15))
    if samples > _MAX_RESPONSE:
        raise ShortfallError(
            f"the impulse response must decay within {_MAX_RESPONSE} samples, not {samples:.3g}: a pole lies too "
            "close to the unit circle"
        )
    return int(samples)


def prewarp(frequency: float, sample_rate: float) -> float:
    """Analog angular frequency in rad/s that the bilinear transformation maps to `frequency` in Hz.

    Equations 10 and 11 of the paper.
    """
    return 2 * sample_rate * math.tan(math.pi * frequency / sample_rate)


def unwarp(angular: float, sample_rate: float) -> float:
    """Frequency in Hz to which the bilinear transformation maps `angular` in rad/s; undoes `prewarp`."""
    return sample_rate / math.pi * math.atan(angular / (2 * sample_rate))


def minimum_order(
    passband_edge: float, stopband_edge: float, passband_loss: float, stopband_loss: float, sample_rate: float
) -> tuple[int, float]:
    """Minimum order of a Butterworth low-pass and its cutoff, equations 10 to 13 of the paper.

    Parameters
    ----------
    passband_edge, stopband_edge : float
        Hz, rising, below half the sample rate.
    passband_loss, stopband_loss : float
        Largest loss in the pass band and smallest in the stop band, dB.
    sample_rate : float
        Hz.

    Returns
    -------
    order : int
        Number of poles.
    cutoff : float
        Hz, at -3 dB; the pass-band edge is met exactly, the stop-band edge with what is left over.
    """
    passband, stopband = prewarp(passband_edge, sample_rate), prewarp(stopband_edge, sample_rate)
    ripple = 10 ** (0.1 * passband_loss) - 1
    ratio = math.sqrt((10 ** (0.1 * stopband_loss) - 1) / ripple)
    order = math.ceil(math.log(ratio) / math.log(stopband / passband))
    return order, unwarp(passband / ripple ** (1 / (2 * order)), sample_rate)


def design(spec: FilterSpec, sample_rate: float) -> Filter:
    """Design the filter of a specification.

    Raises
    ------
    SpecificationError
        If the edges and losses need more poles than can be realised.
    """
    fs = float(sample_rate)
    passband_loss = None if spec.passband_loss is None else float(spec.passband_loss)
    stopband_loss = None if spec.stopband_loss is None else float(spec.stopband_loss)
    aliasing = None
    if spec.sos is not None:
        sos = np.array([[float(v) for v in row] for row in spec.sos])
        order, cutoff = sum(2 if row[5] else 1 if row[4] else 0 for row in sos), None
        family, kind = "sections", _kind_of(sos)
    else:
        family, kind = spec.family, spec.kind
        order, cutoff = _order_and_cutoff(spec, fs)
        if spec.method == "impulse_invariant":
            analog = analog_lowpass(family, order, cutoff[0], passband_loss, stopband_loss)
            sos, aliasing = impulse_invariant(analog, fs)
        else:
            sos = _sections(family, kind, order, cutoff, passband_loss, stopband_loss, fs)
    return Filter(
        sample_rate=fs,
        family=family,
        kind=kind,
        order=order * (2 if kind in {"bandpass", "bandstop"} and spec.sos is None else 1),
        cutoff=cutoff,
        passband_edge=_floats(spec.passband_edge),
        stopband_edge=_floats(spec.stopband_edge),
        passband_loss=passband_loss,
        stopband_loss=stopband_loss,
        rows=tuple(tuple(float(v) for v in row) for row in _normalise(sos, kind, cutoff, fs)),
        aliasing=aliasing,
    )


def _floats(values: Sequence[Fraction] | None) -> tuple[float, ...] | None:
    return None if values is None else tuple(float(v) for v in values)


def _scalar(edges: tuple[float, ...]) -> float | tuple[float, ...]:
    return edges[0] if len(edges) == 1 else edges


def _order_and_cutoff(spec: FilterSpec, fs: float) -> tuple[int, tuple[float, ...]]:
    if spec.order is not None and spec.cutoff is not None:
        return spec.order, tuple(float(f) for f in spec.cutoff)
    passband, stopband = _floats(spec.passband_edge), _floats(spec.stopband_edge)
    # The specification has checked that these come together.
    assert passband is not None
    assert stopband is not None
    losses = float(spec.passband_loss or 0), float(spec.stopband_loss or 0)
    if spec.family == "butterworth" and spec.kind == "lowpass":
        order, single = minimum_order(passband[0], stopband[0], *losses, fs)
        cutoff: tuple[float, ...] = (single,)
    else:
        choose = {
            "butterworth": signal.buttord,
            "chebyshev1": signal.cheb1ord,
            "chebyshev2": signal.cheb2ord,
            "elliptic": signal.ellipord,
        }[spec.family]
        found, natural = choose(_scalar(passband), _scalar(stopband), *losses, fs=fs)
        order, cutoff = int(found), tuple(float(f) for f in np.atleast_1d(natural))
    limit = 10 if spec.kind in {"bandpass", "bandstop"} else 20
    if order > limit:
        raise SpecificationError(
            f"filter's edges and losses must be met by an order of at most {limit}, not {order}: "
            "widen the transition band or lower stopband_loss"
        )
    return order, cutoff


def _sections(
    family: str,
    kind: str,
    order: int,
    cutoff: tuple[float, ...],
    passband_loss: float | None,
    stopband_loss: float | None,
    fs: float,
) -> Array:
    edges = _scalar(cutoff)
    if family == "butterworth":
        zpk = signal.butter(order, edges, kind, fs=fs, output="zpk")
    elif family == "chebyshev1":
        zpk = signal.cheby1(order, passband_loss, edges, kind, fs=fs, output="zpk")
    elif family == "chebyshev2":
        zpk = signal.cheby2(order, stopband_loss, edges, kind, fs=fs, output="zpk")
    elif family == "elliptic":
        zpk = signal.ellip(order, passband_loss, stopband_loss, edges, kind, fs=fs, output="zpk")
    else:
        zpk = signal.bessel(order, edges, kind, fs=fs, output="zpk", norm="mag")
    zeros, poles, gain = np.asarray(zpk[0]), np.asarray(zpk[1]), float(zpk[2])
    if kind in {"lowpass", "highpass"} and len(zeros) == len(poles) and np.all(zeros == zeros[0]):
        return _equal_zeros(float(zeros[0].real), poles, gain)
    return np.asarray(signal.zpk2sos(zeros, poles, gain), dtype=np.float64)


def _equal_zeros(zero: float, poles: npt.NDArray[np.complex128], gain: float) -> Array:
    """Sections of a filter whose zeros all lie in one place: as many zeros as poles in each.

    scipy.signal.zpk2sos would give a filter of odd order a section of one pole and two zeros, and one of two
    poles and one zero. Sections come in scipy's order: poles closest to the unit circle last.
    """
    rows = [(1.0, -zero, 0.0, 1.0, -pole.real, 0.0) for pole in poles if pole.imag == 0]
    rows.sort(key=lambda row: abs(row[4]))
    real = [_pair(*rows[i : i + 2]) for i in range(len(rows) % 2, len(rows), 2)]
    pairs = [
        (1.0, -2 * zero, zero * zero, 1.0, -2 * pole.real, abs(pole) ** 2)
        for pole in sorted((p for p in poles if p.imag > 0), key=abs)
    ]
    sos = np.array([*rows[: len(rows) % 2], *real, *pairs])
    sos[0, :3] *= gain
    return sos


def _pair(first: tuple[float, ...], second: tuple[float, ...]) -> tuple[float, ...]:
    """One second-order section of two first-order ones."""
    return (*np.polymul(first[:2], second[:2]), *np.polymul(first[3:5], second[3:5]))


def _kind_of(sos: Array) -> str:
    """Name the kind of given sections by where their gain is largest."""
    _, response = signal.sosfreqz(sos, worN=2048)
    gain = np.abs(response)
    dc, nyquist, top = gain[0], gain[-1], gain.max()
    if dc >= top / 2:
        return "bandstop" if nyquist >= top / 2 else "lowpass"
    return "highpass" if nyquist >= top / 2 else "bandpass"


def _normalise(sos: Array, kind: str, cutoff: tuple[float, ...] | None, fs: float) -> Array:
    """Give each section unity gain where the filter passes; what is left of the gain goes to the first."""
    if kind in {"lowpass", "bandstop"}:
        z: complex = 1.0
    elif kind == "highpass":
        z = -1.0
    elif cutoff is not None:
        centre = math.sqrt(math.prod(math.tan(math.pi * f / fs) for f in cutoff))
        z = complex(math.cos(2 * math.atan(centre)), math.sin(2 * math.atan(centre)))
    else:
        frequencies, response = signal.sosfreqz(sos, worN=2048)
        z = complex(np.exp(1j * frequencies[np.argmax(np.abs(response))]))
    result = np.array(sos)
    total = 1.0
    for row in result:
        gain = _gain(row, z)
        if gain == 0:
            continue
        total *= gain
        row[:3] /= gain
    if abs(total - 1) > (_SNAP if cutoff is not None else _SNAP_GIVEN):
        result[0, :3] *= total
    return result


def _gain(row: Array, z: complex) -> float:
    """Gain of a section at z: with its sign where the response is real, else its magnitude."""
    response = complex(np.polyval(row[:3], z) / np.polyval(row[3:], z))
    return response.real if isinstance(z, float) else abs(response)
