"""Decimation before a low-pass filter: how far, with how many CIC stages, and what the lower rate costs.

The decimator (`sosmith.model.dataflow.decimator`) is a CIC filter of N stages that hands on every R-th sample. Its gain
at the frequency f is ``(sin(pi f R / fs) / (R sin(pi f / fs)))**N``, which has N zeros wherever something would fold
onto zero frequency, and which droops towards the upper edge of the pass band.

**Droop.** ``C(z) = 1 + g - g / z`` at the lower rate makes up for it: of its squared magnitude,
``1 + 2 g (1 + g) (1 - cos w)``, the term in ``w**2`` cancels that of the CIC filter, ``1 - N (1 - R**-2) w**2 / 12``,
if ``g (1 + g) = N (1 - R**-2) / 12``. It costs no pole and takes g samples off the delay. A section of first order has
room for its zero; a filter without one gets a section of its own.

**Aliasing.** What lies within the cutoff F of a multiple k of the lower rate folds into the pass band. There the gain
of the CIC filter is largest at ``k fs / R - F``: with ``d = F R / fs`` below 1/2, no numerator ``sin(pi t)`` for t in
[-d, d] exceeds ``sin(pi d)``, and no denominator ``R sin(pi (k + t) / R)`` up to half the sample rate is smaller than
that at ``t = -d``. Behind it comes the gain of the filter, with the correction, which is more than 1 towards F, and
with the ripple of the pass band: `sosmith.gen.filter.largest_gain` bounds the product of both, in the pass band and
elsewhere, where the filter is there to stop what folds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import accumulate

import numpy as np
from flint import arb, fmpq

from sosmith.gen.filter.design import Array, Filter, design
from sosmith.gen.filter.exact_form import Exact
from sosmith.gen.filter.largest_gain import Peak, band_gains, passband_gains
from sosmith.gen.filter.response import Complex, complex_response
from sosmith.gen.filter.sections import Row
from sosmith.gen.specification.choices import AUTO, MAX_DECIMATION, MAX_RATIO
from sosmith.gen.specification.specification import FilterSpec
from sosmith.model.arithmetic.correct_rounding import evaluate, nearest_double, nearest_multiple
from sosmith.model.dataflow.cic import impulse_response
from sosmith.model.dataflow.decimator import MAX_WIDTH
from sosmith.model.errors import ShortfallError

MAX_STAGES = 12
"""Most stages of a decimator."""

_CHOSEN_STAGES = 8
"""Most stages that `choose` takes where the factor is left to it."""

MAX_DELAY = Fraction(11, 10)
"""Longest delay that `choose` accepts, as a multiple of that of the filter without a decimator."""

MAX_DEVIATION = 0.1
"""Largest deviation in dB, in the pass band, from the gain of the filter without a decimator that it accepts."""

_CORRECTION_BITS = 10
"""Fraction bits of the correction g."""

_ALIASING_BITS = 192
"""Fraction bits of the bounds on aliasing."""

PLACES = 1 << 16
"""Places of the lower rate, at one of which the pass band is taken to end where chains are bounded."""

SAMPLED = 256
"""Frequencies in the pass band at which gains are compared."""


@dataclass(frozen=True, kw_only=True)
class Decimation:
    """How samples are decimated before a filter.

    Attributes
    ----------
    factor, stages : int
        R and N.
    sample_rate : Fraction
        Rate of the input, in Hz.
    edge : Fraction
        Upper edge of the pass band, in Hz: the cutoff.
    """

    factor: int
    stages: int
    sample_rate: Fraction
    edge: Fraction

    @property
    def rate(self) -> Fraction:
        """The lower rate, in Hz."""
        return self.sample_rate / self.factor

    @property
    def correction(self) -> Fraction:
        """The weight g of the correction of the droop, to `_CORRECTION_BITS` fraction bits."""
        square = 1 + Fraction(self.stages * (self.factor**2 - 1), 3 * self.factor**2)
        # g = (sqrt(square) - 1) / 2, rounded to nearest
        root = math.isqrt(math.floor(square * 4**_CORRECTION_BITS))
        return Fraction((root - 2**_CORRECTION_BITS + 1) // 2, 2**_CORRECTION_BITS)

    @property
    def aliasing(self) -> tuple[Fraction, ...]:
        """Bounds on the gain of what folds into the pass band from around each multiple of the lower rate.

        They are those from `rate` itself to half the sample rate, and exceed the true maximum by less than 2**-191.
        """
        ratio = self.edge / self.rate
        return tuple(self._fold(band, ratio) for band in range(1, self.factor // 2 + 1))

    def _fold(self, band: int, ratio: Fraction) -> Fraction:
        def gain() -> Fraction:
            above = arb.sin_pi_fmpq(_fmpq(ratio))
            below = self.factor * arb.sin_pi_fmpq(_fmpq((band - ratio) / self.factor))
            return nearest_multiple((above / below) ** self.stages, _ALIASING_BITS)

        return evaluate(gain) + Fraction(1, 2**_ALIASING_BITS)

    @property
    def worst_aliasing(self) -> Fraction:
        """Largest gain of anything that folds into the pass band."""
        return max(self.aliasing)

    def bands(self, filter_: Filter) -> tuple[Peak, ...]:
        """Largest gains to the output of a corrected filter, one for the band around each multiple of the lower rate.

        Together the bands reach from half the lower rate to half the sample rate. In each, `Peak.at` is in units of the
        lower rate; what comes out there came from so much below the multiple.
        """
        return band_gains(filter_.exact, self.factor, self.stages)

    def passing(self, filter_: Filter, bands: int | None = None) -> tuple[Peak, ...]:
        """Largest gains to the output of a corrected filter of what folds into the pass band, one for each band.

        They are those of `aliasing` times the filter's own gain, which the correction raises, where the product is the
        largest; rounded up, the pass band ends at the next multiple of `PLACES` of the lower rate. The first band has
        more than any other. With `bands`, of so many alone.
        """
        edge = Fraction(math.ceil(self.edge / self.rate * PLACES), PLACES)
        return passband_gains(filter_.exact, self.factor, self.stages, edge, bands or self.factor // 2)

    def corrected(self, ideal: Filter) -> Filter:
        """Return a filter designed at the lower rate with the correction of the droop in it."""
        taps = (1 + self.correction, -self.correction)
        rows = list(ideal.rows)
        first = next((k for k, row in enumerate(rows) if row[2] == 0 and row[5] == 0), None)
        if first is None:
            rows.append((float(taps[0]), float(taps[1]), 0.0, 1.0, 0.0, 0.0))
        else:
            rows[first] = _times(rows[first], taps)
        return replace(ideal, rows=tuple(rows), exact=(*ideal.exact, (taps, (Fraction(1),))), decimated=self.factor)

    def delay(self, filter_: Filter) -> Fraction:
        """Group delay at zero frequency of the decimator and a corrected filter, in s."""
        return group_delay(filter_.exact) / self.rate + own_delay(self.factor, self.stages) / self.sample_rate

    def deviation(self, filter_: Filter, direct: Filter) -> float:
        """Largest deviation of decimator and corrected filter from a `direct` one in dB, at `SAMPLED` frequencies."""
        frequency = np.array([k * float(self.edge) / SAMPLED for k in range(1, SAMPLED + 1)])
        decimated_gain = self.gain(frequency) * np.abs(complex_response(filter_.sos, frequency, float(self.rate)))
        wanted = np.abs(complex_response(direct.sos, frequency, float(self.sample_rate)))
        ratios = (decimated_gain / wanted).tolist()
        return max(20 * math.log10(max(ratios)), -20 * math.log10(min(ratios)))

    def response(self, frequency: Array) -> Complex:
        """Response of the decimator at frequencies in Hz: its gain, and the phase of its delay."""
        angles = (math.pi * self.stages * (self.factor - 1) / float(self.sample_rate) * frequency).ravel().tolist()
        phases = np.array([complex(math.cos(angle), -math.sin(angle)) for angle in angles]).reshape(frequency.shape)
        response: Complex = self._sines(frequency) ** self.stages * phases
        return response

    def gain(self, frequency: Array) -> Array:
        """Magnitude of the decimator's response at frequencies in Hz."""
        return np.abs(self._sines(frequency) ** self.stages)

    def _sines(self, frequency: Array) -> Array:
        """Response of one stage without its delay, a real number."""
        angles = (math.pi / float(self.sample_rate) * frequency).ravel().tolist()
        ratios = [
            math.sin(self.factor * angle) / (self.factor * math.sin(angle)) if math.sin(angle) else 1.0
            for angle in angles
        ]
        return np.array(ratios).reshape(frequency.shape)


def own_delay(factor: int, stages: int) -> Fraction:
    """Delay of a decimator alone, in samples at the higher rate: half the length of its symmetric response."""
    return Fraction(stages * (factor - 1), 2)


def decimated_step(factor: int, stages: int) -> Array:
    """Step response of a decimator at its results, of gain 1, until it has reached 1.

    The step comes with a sample that brings a result, the first value.

    Examples
    --------
    >>> decimated_step(2, 2).tolist()
    [0.25, 1.0]
    """
    response = impulse_response(factor, stages)
    reached = list(accumulate([*response, *[0] * (-(len(response) - 1) % factor)]))[::factor]
    return np.array([value / factor**stages for value in reached])


def _fmpq(value: Fraction) -> fmpq:
    return fmpq(value.numerator, value.denominator)


def _times(row: Row, taps: Sequence[Fraction]) -> Row:
    """Multiply the numerator of a section of first order by two taps."""
    b0, b1 = Fraction(row[0]), Fraction(row[1])
    numerator = (b0 * taps[0], b1 * taps[0] + b0 * taps[1], b1 * taps[1])
    return (*map(float, numerator), *row[3:])


def group_delay(exact: Sequence[Exact]) -> Fraction:
    """Group delay of sections at zero frequency, in samples: the centre of the numerators' taps less the poles'."""
    return sum((_centre(b) - _centre(a) for b, a in exact), Fraction(0))


def _centre(taps: Sequence[Fraction]) -> Fraction:
    return sum((k * tap for k, tap in enumerate(taps)), Fraction(0)) / sum(taps, Fraction(0))


def stages_for(
    factor: int, spec: FilterSpec, sample_rate: Fraction, allowed: Fraction, most: int = MAX_STAGES
) -> Decimation | None:
    """Return a decimation by `factor` with the fewest stages whose aliasing is small enough; None if none is.

    That of the decimator alone, and that of the whole with the filter behind it.

    Parameters
    ----------
    factor : int
        A power of two.
    spec : FilterSpec
        A low-pass filter by order and cutoff.
    sample_rate : Fraction
        Of the input, in Hz.
    allowed : Fraction
        Largest gain of what folds into the pass band.
    most : int
        Most stages.
    """
    assert spec.cutoff is not None
    for stages in range(1, most + 1):
        decimation = Decimation(factor=factor, stages=stages, sample_rate=sample_rate, edge=spec.cutoff[0])
        if decimation.worst_aliasing > allowed:
            continue
        (worst,) = decimation.passing(decimated(spec, decimation), bands=1)
        if worst.gain <= allowed:
            return decimation
    return None


def decimated(spec: FilterSpec, decimation: Decimation) -> Filter:
    """Design the filter behind a decimator, with the correction of its droop."""
    return decimation.corrected(design(spec, decimation.rate))


def choose(spec: FilterSpec, sample_rate: Fraction, allowed: Fraction, bits: int) -> tuple[Decimation | None, str]:
    """Choose how far to decimate before a filter.

    Parameters
    ----------
    spec : FilterSpec
        A low-pass filter by order and cutoff, with `decimate`.
    sample_rate : Fraction
        Of the input, in Hz.
    allowed : Fraction
        Largest gain of what folds into the pass band.
    bits : int
        Width of the input.

    Returns
    -------
    Decimation or None
        None if "auto" finds that none is better than to filter all samples.
    str
        Why, in a sentence without a full stop.

    Raises
    ------
    ShortfallError
        If the factor that is asked for lets too much fold into the pass band.
    """
    assert spec.cutoff is not None

    def fits(decimation: Decimation) -> bool:
        return bits + decimation.stages * (decimation.factor.bit_length() - 1) <= MAX_WIDTH

    if spec.decimate != AUTO:
        factor = int(spec.decimate or 1)
        decimation = stages_for(factor, spec, sample_rate, allowed)
        if decimation is None or not fits(decimation):
            raise ShortfallError(
                f"filter.decimate must be so small that a full-scale sine which folds into the pass band is at most "
                f"output.max_error with {MAX_STAGES} stages of at most {MAX_WIDTH} bits, not {factor}"
            )
        return decimation, f"by {factor}: asked for in the specification; {_why_stages(decimation)}"
    direct = design(spec, sample_rate)
    longest = MAX_DELAY * group_delay(direct.exact) / sample_rate
    best, factor = None, 2
    while factor <= MAX_DECIMATION and factor * spec.cutoff[0] <= MAX_RATIO * sample_rate:
        decimation = stages_for(factor, spec, sample_rate, allowed, _CHOSEN_STAGES)
        if decimation is not None and fits(decimation):
            filter_ = decimated(spec, decimation)
            if decimation.delay(filter_) <= longest and decimation.deviation(filter_, direct) <= MAX_DEVIATION:
                best = decimation
        factor *= 2
    limits = f"a delay at most {float(100 * (MAX_DELAY - 1)):g} % longer and a gain within {MAX_DEVIATION:g} dB"
    if best is None:
        return None, f"none: no power of two has {limits}"
    return best, f"by {best.factor}: the largest power of two with {limits}; {_why_stages(best)}"


def _why_stages(decimation: Decimation) -> str:
    stages = "1 stage keeps" if decimation.stages == 1 else f"{decimation.stages} stages keep"
    return f"{stages} what folds into the pass band below {nearest_db(decimation.worst_aliasing):.1f} dB"


def nearest_db(gain: Fraction) -> float:
    """Return a gain in dB, correctly rounded."""
    return evaluate(lambda: nearest_double(20 * arb(fmpq(gain.numerator, gain.denominator)).log() / arb(10).log()))
