"""Filter design: from the specification to second-order sections that are the same on every machine.

Minimum order, cutoff, poles, zeros and gains are derived from the specification's numbers in ball arithmetic and
rounded once: to rationals with hundreds of bits, against which everything is proven, and to doubles, from which
hardware is made. See `sosmith.gen.filter.sections` for what is rounded. Sign convention of the sections: scipy's,
``a0 = 1``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache, cached_property, partial

import numpy as np
import numpy.typing as npt
from flint import acb, arb, ctx, fmpq

from sosmith.gen.filter.exact_form import Exact, exact_bilinear, exact_form, given_form, pole_factors
from sosmith.gen.filter.impulse_invariance import Aliasing, aliasing, impulse_invariant, simple_level
from sosmith.gen.filter.loss_mask import LossMask, mask_of
from sosmith.gen.filter.minimum_order import least_order
from sosmith.gen.filter.prototypes import Prototype, prototype
from sosmith.gen.filter.sections import Row, rounded, sections
from sosmith.gen.filter.short_coefficients import ExactRow, Nominal, short_rows
from sosmith.gen.filter.transformations import bilinear, unwarped, warped
from sosmith.gen.quantity import count, frequency
from sosmith.gen.specification.choices import FIR, FIR_FAMILIES, MAX_DECIMATION
from sosmith.gen.specification.specification import FilterSpec
from sosmith.model.arithmetic.correct_rounding import evaluate, nearest_double, sign
from sosmith.model.arithmetic.recursive_filters import dc_gain, sosfilt
from sosmith.model.errors import ShortfallError, SpecificationError

Array = npt.NDArray[np.float64]

_MAX_RESPONSE = 1 << 24  # samples; poles so close to the unit circle that responses are longer are refused
_DECAY = 1e-12  # relative to its envelope, where an impulse response counts as decayed
_LONG = 1 << 15  # samples, beyond which responses are cut shorter where they are only estimated
_COMFORTABLE = 20  # samples per period of the band edge; fewer hardly reduce the word lengths
_UNITY = 1e-14  # relative distance within which the gain of given sections counts as one: rounding, not intent
_MARGINS = 64  # parts of the losses by which a mask is narrowed around the filter from which a search starts
_GRID = 2048  # frequencies up to half the sample rate at which given sections are evaluated
_ROUGH = 64  # bits with which the largest of these gains are looked for
_NEARLY = 1 + 2**-50  # gains this near to each other may round to one double
_DECIDED = 1e-6  # relative distance from half the largest gain beyond which doubles say on which side a gain is


@dataclass(frozen=True, kw_only=True)
class Filter:
    """A designed filter as a cascade of sections, each normalised to unity gain at one frequency.

    Attributes
    ----------
    sample_rate : float
        Hz.
    family, kind : str
        As in the specification; ``"sections"`` or ``"fir"`` as the family if sections or taps were given.
    order : int
        Number of poles; of an FIR filter, of taps less 1.
    cutoff : tuple of float or None
        Hz, as the family defines it, also of a filter that is only near that of the family; None if the sections were
        given.
    passband_edge, stopband_edge : tuple of float or None
        Hz; None if the specification does not state them.
    passband_loss, stopband_loss : float or None
        dB, likewise.
    rows : tuple of tuple of float
        (b0, b1, b2, 1, a1, a2) per section, in the order of the cascade. Of an FIR filter, one row: its taps, at least
        three, and as many of 1, 0, 0, ...
    exact : tuple of tuple
        Numerator and denominator of the same sections as dyadic rationals, in any order, whose product is the specified
        filter far more accurately than that of `rows`: proofs compare with it.
    aliasing : Aliasing or None
        Deviation of an impulse-invariant filter from its analog model; None for all others.
    decimated : int
        Factor of the decimator in front, which hands on samples at `sample_rate`; 1 without one.
    freedom : str
        "mask" if it is only near the filter of the family, inside its mask with coefficients of few digits.
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
    rows: tuple[Row, ...]
    exact: tuple[Exact, ...]
    aliasing: Aliasing | None = None
    decimated: int = 1
    freedom: str = "none"

    @property
    def sos(self) -> Array:
        """Sections in scipy's form, shape (sections, 6); of an FIR filter, shape (1, 2 * taps)."""
        return np.array(self.rows, dtype=np.float64)

    @cached_property
    def impulse_response(self) -> Array:
        """Impulse response, until it has decayed below 1e-12 of its envelope, whatever the order of the sections."""
        return impulse_response(np.array(sorted(self.rows), dtype=np.float64))

    @property
    def dc_gain(self) -> float:
        """Gain at zero frequency."""
        return dc_gain(self.sos)

    @property
    def is_fir(self) -> bool:
        """Whether it has taps, and is made by realizations for any number of them."""
        return self.family in {FIR, *FIR_FAMILIES}

    @property
    def cutoff_of_stopband(self) -> bool:
        """Whether the cut-off is where the stopband begins, as that of a Chebyshev filter of the second kind."""
        return self.family == "chebyshev2" and self.passband_edge is None

    @property
    def decimation(self) -> int:
        """Largest power-of-two decimation that leaves the upper band edge below a twentieth of the sample rate.

        At most what `filter.decimate` takes; 1 if there is none, if the filter passes high frequencies, or if its
        cutoff is not known.
        """
        if self.cutoff is None or self.kind not in {"lowpass", "bandpass"}:
            return 1
        factor = 1 << max(0, math.floor(math.log2(self.sample_rate / (_COMFORTABLE * self.cutoff[-1]))))
        return min(factor, MAX_DECIMATION)

    @property
    def describe(self) -> str:
        """One-line description: family, kind, order, cutoff, sample rate, and what else is not the default."""
        if self.is_fir:
            taps, rate = count(self.order + 1, "tap"), frequency(self.sample_rate)
            if self.family == FIR:  # its kind is where its gain is largest, which misleads of a pure gain or a comb
                return f"FIR of {taps} given at {rate}"
            family = self.family.replace("_", " ")
            if self.freedom == "mask":
                return f"FIR {self.kind} inside its mask, {taps}, near {family}, at {rate}"
            return f"{family} FIR {self.kind}, {taps} at {rate}"
        if self.freedom == "mask":
            near = f"near {self.family.capitalize()}, at {frequency(self.sample_rate)}"
            return f"{self.kind.capitalize()} inside its mask, order {self.order}, {near}"
        if self.cutoff is None:
            return f"{count(len(self.rows), 'given section')} at {frequency(self.sample_rate)}"
        method = "" if self.aliasing is None else ", impulse-invariant"
        filter_ = f"{self.family.capitalize()} {self.kind}, order {self.order}"
        decimated = f", decimated by {self.decimated}" if self.decimated > 1 else ""
        return f"{filter_}, {frequency(*self.cutoff)} at {frequency(self.sample_rate)}{method}{decimated}"


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
    return sosfilt(sos, impulse)


def decay_length(sos: Array) -> int:
    """Count the samples after which the slowest mode has decayed to 1e-12, with a margin for repeated poles."""
    taps = sos.shape[1] // 2
    if taps > 3:
        return int(taps * len(sos))
    radius = max((_radius(float(row[4]), float(row[5])) for row in sos), default=0.0)
    samples = 64.0 if radius < 1e-3 else 64 + 1.5 * math.log(_DECAY) / math.log(min(radius, 1 - 1e-15))
    if samples > _MAX_RESPONSE:
        raise ShortfallError(
            f"the impulse response must decay within {_MAX_RESPONSE} samples, not {samples:.3g}: a pole lies too "
            "close to the unit circle"
        )
    return int(samples)


def estimated_length(sos: Array) -> int:
    """Count the samples that estimates need: half of a long response, which leaves out 1e-6 of its envelope."""
    length = decay_length(sos)
    return max(_LONG, length // 2) if length > _LONG else length


def _radius(a1: float, a2: float) -> float:
    """Magnitude of the larger pole of a section."""
    square = Fraction(a1) ** 2 - 4 * Fraction(a2)  # exact: nearly equal poles differ by its square root
    return math.sqrt(a2) if square < 0 else (abs(a1) + math.sqrt(square)) / 2


def prewarp(frequency: float, sample_rate: float) -> float:
    """Analog angular frequency in rad/s that the bilinear transformation maps to `frequency` in Hz.

    Equations 10 and 11 of the paper.
    """
    return 2 * sample_rate * math.tan(math.pi * frequency / sample_rate)


def unwarp(angular: float, sample_rate: float) -> float:
    """Frequency in Hz to which the bilinear transformation maps `angular` in rad/s; the inverse of `prewarp`."""
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
        Number of poles; of an FIR filter, of taps less 1.
    cutoff : float
        Hz, at -3 dB; the pass-band edge is met exactly, the stop-band edge with margin.
    """
    fs = Fraction(sample_rate)

    def order_and_cutoff() -> tuple[int, float]:
        order, (edge,) = least_order(
            "butterworth",
            "lowpass",
            [warped(Fraction(passband_edge), fs)],
            [warped(Fraction(stopband_edge), fs)],
            (Fraction(passband_loss), Fraction(stopband_loss)),
        )
        return order, nearest_double(unwarped(edge, fs))

    return evaluate(order_and_cutoff)


def design(spec: FilterSpec, sample_rate: Fraction | float) -> Filter:
    """Design the filter of a specification.

    Parameters
    ----------
    spec : FilterSpec
    sample_rate : Fraction or float
        Hz; used exactly.

    Raises
    ------
    SpecificationError
        If the edges and losses need more poles than can be realised.
    """
    fs = Fraction(sample_rate)
    if spec.sos is not None:
        stated = spec.sos
        given = tuple(tuple(float(value) for value in row) for row in spec.sos)
        kind, rows = evaluate(lambda: _normalized(given))
        exact = evaluate(lambda: given_form(stated))
        return _filter(spec, fs, "sections", kind, rows, exact, order=_poles(given))
    if spec.taps is not None:
        return _fir(spec, spec.taps, fs)
    if spec.family in FIR_FAMILIES:
        return replace(_fir(spec, _designed(spec, fs), fs), family=spec.family, kind=spec.kind)
    order, cutoff = evaluate(lambda: _order_and_cutoff(spec, fs))
    alias: Aliasing | None = None
    if spec.method == "impulse_invariant":
        assert spec.cutoff is not None  # the specification has checked it
        ratio = spec.cutoff[0] / fs
        rows, exact = evaluate(lambda: _sampled(spec, order, ratio))
        alias = evaluate(lambda: aliasing(_prototype(spec, order), ratio))
    elif spec.freedom == "mask":
        short = _short(spec, fs)
        rows, exact = tuple(tuple(map(float, row)) for row in short), evaluate(lambda: given_form(short))
    else:
        rows, exact = evaluate(lambda: _bilinear(spec, fs))
    doubled = 2 if spec.kind in {"bandpass", "bandstop"} else 1
    return _filter(spec, fs, spec.family, spec.kind, rows, exact, order=doubled * order, cutoff=cutoff, aliasing=alias)


def _fir(spec: FilterSpec, taps: Sequence[Fraction], fs: Fraction) -> Filter:
    """Return the filter with given taps; they stay as they are, so that equal ones stay equal."""
    row = fir_row(taps)
    doubles = tuple(float(value) for value in row)
    return _filter(spec, fs, FIR, _kind_of(doubles), (doubles,), given_form([row]), order=len(taps) - 1)


def _kind_of(row: tuple[float, ...]) -> str:
    """Return the kind of taps as `_kind_and_reference` does; from doubles, where their errors cannot change it."""
    gains = np.abs(np.fft.rfft(row[: len(row) // 2], 2 * _GRID))[:_GRID]
    dc, nyquist, top = gains[0], gains[-1], gains.max()
    if top and all(abs(gain / top - 0.5) > _DECIDED for gain in (dc, nyquist)):
        if dc >= top / 2:
            return "bandstop" if nyquist >= top / 2 else "lowpass"
        return "highpass" if nyquist >= top / 2 else "bandpass"
    return evaluate(lambda: _kind_and_reference([row]))[0]


def _designed(spec: FilterSpec, fs: Fraction) -> tuple[Fraction, ...]:
    from sosmith.gen.filter.fir_design import designed_taps  # noqa: PLC0415 - slow to load
    from sosmith.gen.filter.short_taps import short_taps  # noqa: PLC0415 - imports fir_design, too

    return (short_taps if spec.freedom == "mask" else designed_taps)(spec.family, _mask(spec, fs))


def fir_row(taps: Sequence[Fraction]) -> tuple[Fraction, ...]:
    """Return a filter's taps as the row of a section of an order of at least 2.

    >>> fir_row([Fraction(1), Fraction(1)]) == (1, 1, 0, 1, 0, 0)
    True
    """
    short = max(0, 3 - len(taps))
    return (*taps, *[Fraction(0)] * short, Fraction(1), *[Fraction(0)] * (len(taps) + short - 1))


def _filter(
    spec: FilterSpec,
    fs: Fraction,
    family: str,
    kind: str,
    rows: tuple[Row, ...],
    exact: tuple[Exact, ...],
    *,
    order: int,
    cutoff: tuple[float, ...] | None = None,
    aliasing: Aliasing | None = None,
) -> Filter:
    return Filter(
        sample_rate=float(fs),
        family=family,
        kind=kind,
        order=order,
        cutoff=cutoff,
        passband_edge=_floats(spec.passband_edge),
        stopband_edge=_floats(spec.stopband_edge),
        passband_loss=None if spec.passband_loss is None else float(spec.passband_loss),
        stopband_loss=None if spec.stopband_loss is None else float(spec.stopband_loss),
        rows=rows,
        exact=exact,
        aliasing=aliasing,
        freedom=spec.freedom,
    )


def _floats(values: Sequence[Fraction] | None) -> tuple[float, ...] | None:
    return None if values is None else tuple(float(v) for v in values)


def _order_and_edges(spec: FilterSpec, fs: Fraction) -> tuple[int, tuple[arb, ...]]:
    """Order of the prototype, and pre-warped edges as the family defines them."""
    if spec.order is not None and spec.cutoff is not None:
        return spec.order, tuple(warped(edge, fs) for edge in spec.cutoff)
    # The specification has checked that these are given together.
    assert spec.passband_edge is not None
    assert spec.stopband_edge is not None
    assert spec.passband_loss is not None
    assert spec.stopband_loss is not None
    passband, stopband = ([warped(edge, fs) for edge in edges] for edges in (spec.passband_edge, spec.stopband_edge))
    order, edges = least_order(spec.family, spec.kind, passband, stopband, (spec.passband_loss, spec.stopband_loss))
    limit = 10 if spec.kind in {"bandpass", "bandstop"} else 20
    if order > limit:
        raise SpecificationError(
            f"filter's edges and losses must be met by an order of at most {limit}, not {order}: "
            "widen the transition band or lower stopband_loss"
        )
    return order, edges


def _order_and_cutoff(spec: FilterSpec, fs: Fraction) -> tuple[int, tuple[float, ...]]:
    """Order of the prototype, and its edges in Hz."""
    if spec.order is not None and spec.cutoff is not None:
        return spec.order, tuple(float(edge) for edge in spec.cutoff)
    order, edges = _order_and_edges(spec, fs)
    return order, tuple(nearest_double(unwarped(edge, fs)) for edge in edges)


def _prototype(spec: FilterSpec, order: int) -> Prototype:
    return prototype(spec.family, order, spec.passband_loss, spec.stopband_loss)


_Both = tuple[tuple[Row, ...], tuple[Exact, ...]]
"""Rounded to doubles, and exact."""


def _bilinear(spec: FilterSpec, fs: Fraction) -> _Both:
    order, edges = _order_and_edges(spec, fs)
    digital = bilinear(_prototype(spec, order), spec.kind, edges)
    return rounded(sections(digital), digital.passing, digital.level), exact_bilinear(digital)


def _short(spec: FilterSpec, fs: Fraction) -> tuple[ExactRow, ...]:
    """Return sections with few digits inside the mask, searched near the family's filter that keeps furthest from it.

    Raises
    ------
    ShortfallError
        If there are none.
    """
    order, _ = evaluate(lambda: _order_and_edges(spec, fs))
    centred = _centred(spec, fs, order)
    cascade, at = evaluate(lambda: _nominal(centred, fs, order))
    return short_rows(tuple(cascade), _mask(spec, fs), at)


def _centred(spec: FilterSpec, fs: Fraction, order: int) -> FilterSpec:
    """Return the losses of a mask as far inside this one as the order allows."""
    low, high = 0, _MARGINS
    while high - low > 1:
        share = (low + high) // 2
        narrower = _narrowed(spec, Fraction(share, _MARGINS))
        try:
            fits = evaluate(partial(_order_and_edges, narrower, fs))[0] <= order
        except SpecificationError:
            fits = False
        low, high = (share, high) if fits else (low, share)
    return _narrowed(spec, Fraction(low, _MARGINS))


def _narrowed(spec: FilterSpec, share: Fraction) -> FilterSpec:
    """Return narrower losses: less by a share in the pass band, and more by up to 1 dB in the stop band.

    Coefficients move the gain in the pass band by as many dB as in the stop band, where there is more room.
    """
    assert spec.passband_loss is not None
    assert spec.stopband_loss is not None
    return replace(spec, passband_loss=spec.passband_loss * (1 - share), stopband_loss=spec.stopband_loss + share)


def _nominal(spec: FilterSpec, fs: Fraction, order: int) -> tuple[list[Nominal], int | None]:
    """Return a family's filter by doubles, and at which real z its gain is 1; None if at none."""
    _, edges = _order_and_edges(spec, fs)
    digital = bilinear(_prototype(spec, order), spec.kind, edges)
    cascade = [
        Nominal(*(tuple(map(nearest_double, taps)) for taps in (section.numerator, section.denominator)))
        for section in sections(digital)
    ]
    is_one = nearest_double(digital.level) == 1 and nearest_double(digital.passing.imag) == 0
    return cascade, int(nearest_double(digital.passing.real)) if is_one else None


def _mask(spec: FilterSpec, fs: Fraction) -> LossMask:
    # The specification has checked that these are given together.
    assert spec.passband_edge is not None
    assert spec.stopband_edge is not None
    assert spec.passband_loss is not None
    assert spec.stopband_loss is not None
    passband, stopband = (tuple(edge / fs for edge in edges) for edges in (spec.passband_edge, spec.stopband_edge))
    return mask_of(spec.kind, passband, stopband, (spec.passband_loss, spec.stopband_loss))


def _sampled(spec: FilterSpec, order: int, ratio: Fraction) -> _Both:
    sampled = impulse_invariant(_prototype(spec, order), ratio)
    rows = rounded(sampled.sections(), acb(1), simple_level(sampled.level))
    over = [tap.real for tap in sampled.numerator.coeffs()]
    return rows, exact_form(over, [], pole_factors(sampled.pole_pairs, sampled.real_poles))


def _poles(rows: Sequence[Row]) -> int:
    """Count the poles of given sections, without those at the origin."""
    return sum(2 if row[5] else 1 if row[4] else 0 for row in rows)


def _normalized(rows: Sequence[Row]) -> tuple[str, tuple[Row, ...]]:
    """Kind of given sections, and the sections scaled to unity gain in the pass band.

    The first section takes the remaining gain.
    """
    kind, z = _kind_and_reference(rows)
    numerator_balls, total = [], arb(1)
    for row in rows:
        response = _response([row], z)
        # If the response is real, its sign is kept, so that a section that inverts the signal also has unity gain.
        gain = abs(response) if kind == "bandpass" else response.real
        if sign(gain) == 0:
            numerator_balls.append([arb(b) for b in row[:3]])
            continue
        total *= gain
        numerator_balls.append([arb(b) / gain for b in row[:3]])
    if abs(nearest_double(total - 1)) > _UNITY:
        numerator_balls[0] = [b * total for b in numerator_balls[0]]
    numerators = [tuple(nearest_double(b) for b in numerator) for numerator in numerator_balls]
    return kind, tuple((*numerator, *row[3:]) for numerator, row in zip(numerators, rows, strict=True))


def _kind_and_reference(rows: Sequence[Row]) -> tuple[str, acb]:
    """Kind of given sections, by the frequency of their largest gain, and the point on the unit circle to scale at."""
    highest = _highest(rows)
    gains = {k: nearest_double(abs(_response(rows, _on_grid(k)))) for k in {0, *highest, _GRID - 1}}
    dc, nyquist, top = gains[0], gains[_GRID - 1], max(gains.values())
    if dc >= top / 2:
        kind = "bandstop" if nyquist >= top / 2 else "lowpass"
    else:
        kind = "highpass" if nyquist >= top / 2 else "bandpass"
    if kind == "bandpass":
        return kind, _on_grid(min(k for k, gain in gains.items() if gain == top))
    return kind, acb(-1 if kind == "highpass" else 1)


def _highest(rows: Sequence[Row]) -> list[int]:
    """Return the places on the grid whose gain may be the largest, or round to the same double."""
    with ctx.workprec(_ROUGH):
        gains = [abs(_response(rows, z)) for z in _rough_grid()]
        largest = max((gain for gain in gains if gain.is_finite()), key=arb.lower, default=arb(0))
        return [k for k, gain in enumerate(gains) if not gain * _NEARLY < largest]


@cache
def _rough_grid() -> Sequence[acb]:
    return [_on_grid(k) for k in range(_GRID)]


def _on_grid(k: int) -> acb:
    """Return a point of the upper half of the unit circle, whose grid ends just below half the sample rate."""
    return acb(arb.cos_pi_fmpq(fmpq(k, _GRID)), arb.sin_pi_fmpq(fmpq(k, _GRID)))


def _response(rows: Sequence[Row], z: acb) -> acb:
    value = acb(1)
    for row in rows:
        taps = len(row) // 2
        value *= _horner(row[:taps], z) / _horner(row[taps:], z)
    return value


def _horner(coefficients: Sequence[float], z: acb) -> acb:
    value = acb(0)
    for coefficient in coefficients:
        value = value * z + coefficient
    return value
