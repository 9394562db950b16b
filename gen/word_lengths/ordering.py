"""Pole-zero pairing and ordering of a cascade for the smallest rounding error.

Every section is scaled so that the largest value at its output fits its format. The error of its quantizer is
therefore weighted by the gain from the input to that point, times the gain of the error from there to the output. The
first gain depends only on *which* sections come before, not on their order, and the second only on which come after.
So with S the set of sections already placed and s the next one::

    cost(S, s) = (|| prod of H_i over S and s ||_p  *  || noise_s / A_s * prod of H_j over the others ||_q) ** m
    V(S and s) = min over s of V(S) + cost(S, s)

is exact (dynamic programming over subsets, Dehner 2003). With q = 2 and m = 2, the sum is the noise power at the
output relative to that of one quantizer; with q = 1 and m = 1, it is the worst-case error.

Norms are computed in double precision, those of long responses in single precision. They only guide the choice; the
result is proven afterwards.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
import numpy.typing as npt

from sosmith.gen.filter.design import estimated_length
from sosmith.gen.proof.linear_model import LinearModel
from sosmith.gen.proof.poles import power_of

Norm = Literal["l1", "l2", "linf"]
"""Norm of an impulse response: sum of magnitudes, root of the sum of squares, largest gain over all frequencies."""

Spectrum = npt.NDArray[np.complex128]

_MAX_WORK = 1 << 28
"""Largest total number of spectrum samples for which the order is optimized; takes about three seconds."""

_LONG = 1 << 15
"""Samples of a response beyond which norms are computed in single precision, and with a quarter of the length.

What is behind that is folded back by the periodic transform; its envelope has fallen below 1 %.
"""

_DIGITS, _ROUGH_DIGITS = 12, 5
"""Decimal digits to which a cost is known, and for long responses."""

_WORTH_IT = 2 / 3
"""The order is changed only if this reduces the error below this fraction of its previous value. Word lengths are whole
bits: on the designs of tests/gen/word_lengths/test_sweep.py, a larger reduction saves 2 % of the register bits on
average, a smaller one nothing."""


@dataclass(frozen=True, kw_only=True)
class NoisySection:
    """A section and the paths of its rounding errors, as polynomials in ``w = z**-1``, constant term first.

    Attributes
    ----------
    numerator, denominator : tuple of float
        Transfer function; the denominator begins with 1 and has a degree of at most 2, or that in a
        power of w.
    noise : tuple of tuple of float
        Numerator from each error to the section's output, over the same denominator.
    """

    numerator: tuple[float, ...]
    denominator: tuple[float, ...]
    noise: tuple[tuple[float, ...], ...]


@dataclass(frozen=True, kw_only=True)
class Arrangement:
    """Sections in the order of the cascade.

    Attributes
    ----------
    order : tuple of tuple of int
        Indices of the denominator and the numerator at each position.
    cost : float
        Sum over all errors, as defined above.
    """

    order: tuple[tuple[int, int], ...]
    cost: float

    @property
    def decibels(self) -> float:
        """`cost` as a power, in dB."""
        return 10 * math.log10(self.cost)


def arrange(
    sections: Sequence[NoisySection],
    *,
    scale: Norm,
    noise: Norm = "l2",
    pairing: bool = False,
    worst: bool = False,
) -> Arrangement:
    """Find the best arrangement of `sections`.

    Parameters
    ----------
    sections : sequence of NoisySection
        At most about ten, or five with `pairing`.
    scale : Norm
        Norm that sets the range of a signal: "l1" for all inputs, "linf" for sinusoids, "l2" for white noise.
    noise : Norm
        Norm of the errors: "l2" adds powers, the others add amplitudes.
    pairing : bool
        Whether numerators may be paired with other denominators of the same or a higher degree.
    worst : bool
        Find the worst arrangement instead, to show how much can be gained.

    Raises
    ------
    ValueError
        If there are too many sections for the length of their responses.
    """
    return _arranged(_Costs(sections, scale, noise, pairing=pairing), worst=worst)


def _arranged(table: _Costs, *, worst: bool = False) -> Arrangement:
    """Find the best arrangement by dynamic programming."""
    sign = -1 if worst else 1
    reached: dict[_Placed, tuple[float, tuple[tuple[int, int], ...]]] = {(0, 0): (0.0, ())}
    for _ in range(table.count):
        longer: dict[_Placed, tuple[float, tuple[tuple[int, int], ...]]] = {}
        for placed, (cost, order) in reached.items():
            for pole, zero in table.choices(placed):
                after = placed[0] | 1 << pole, placed[1] | 1 << zero
                candidate = (cost + sign * table.cost(after, pole), (*order, (pole, zero)))
                longer[after] = min(longer.get(after, candidate), candidate)
        reached = longer
    ((cost, order),) = reached.values()
    return Arrangement(order=order, cost=sign * cost)


def best_order(models: Sequence[LinearModel]) -> tuple[int, ...]:
    """Order of a cascade with the smallest worst-case rounding error, from the stages' models.

    Both norms are "l1", as in the proof: the formats must hold every input, and the bound must hold for every error.
    The order is kept if another one gains less than a third, or if the table would be too large.
    """
    present = tuple(range(len(models)))
    sections = [_section(model) for model in models]
    if len(models) < 2 or not _feasible(sections, pairing=False):
        return present
    table = _Costs(sections, "l1", "l1", pairing=False)
    best = _arranged(table)
    now = sum(table.cost((placed, placed), k) for k in present for placed in [(1 << k + 1) - 1])
    return tuple(pole for pole, _ in best.order) if best.cost < _WORTH_IT * now else present


def _section(model: LinearModel) -> NoisySection:
    errors = [source for source in model.sources if source.name not in {"input", "constant"}]
    return NoisySection(
        numerator=tuple(map(float, model.transfer)),
        denominator=tuple(map(float, model.denominator)),
        noise=tuple(tuple(map(float, source.numerators[model.output])) for source in errors),
    )


_Placed = tuple[int, int]
"""Bit masks of the denominators and of the numerators already placed."""


def _length(sections: Sequence[NoisySection]) -> int:
    """Length of the spectra: eight times that of the responses, which resolves resonance peaks to 0.1 %."""
    longest = 0
    for section in sections:
        step = power_of(section.denominator)
        poles = [*section.denominator[::step], 0.0, 0.0][:3]
        longest = max(longest, step * estimated_length(np.array([[1.0, 0.0, 0.0, *poles]])))
    return 1 << (8 * longest - 1).bit_length()


def _feasible(sections: Sequence[NoisySection], *, pairing: bool) -> bool:
    count = len(sections)
    states = math.comb(2 * count, count) * count if pairing else 2**count
    return states * count * _length(sections) // 8 <= _MAX_WORK


class _Costs:
    """Norms over sets of sections, each computed once."""

    def __init__(self, sections: Sequence[NoisySection], scale: Norm, noise: Norm, *, pairing: bool) -> None:
        if not _feasible(sections, pairing=pairing):
            raise ValueError(
                f"sections must be so few that their spectra have at most {_MAX_WORK} samples, not {len(sections)}"
            )
        self._sections = sections
        self.count = len(sections)
        self._pairing = pairing
        self._scale, self._noise = scale, noise
        self._full = (1 << len(sections)) - 1
        length = _length(sections)
        if "linf" not in {scale, noise}:
            length //= 8
        self._rough = {scale, noise} == {"l1"} and length > _LONG
        self._length = length // 4 if self._rough else length
        self._spectrum = cache(self._spectrum_uncached)
        self._all_pole = [1 / self._spectrum(s.denominator) for s in sections]
        self._numerators = [self._spectrum(s.numerator) for s in sections]
        self._gain_to = cache(self._gain_to_uncached)
        self._gains_from = cache(self._gains_from_uncached)

    def _spectrum_uncached(self, polynomial: tuple[float, ...]) -> Spectrum:
        return np.asarray(np.fft.rfft(polynomial, self._length), dtype=np.complex128)

    def choices(self, placed: _Placed) -> Iterator[tuple[int, int]]:
        """Pairs of denominator and numerator that may come next."""
        for pole in _members(self._full & ~placed[0]):
            for zero in _members(self._full & ~placed[1]) if self._pairing else (pole,):
                fits = len(self._sections[zero].numerator) <= len(self._sections[pole].denominator)
                if fits or zero == pole:
                    yield pole, zero

    def cost(self, after: _Placed, last: int) -> float:
        """Cost of the section whose denominator is `last`, given the set of sections placed so far, itself included."""
        gain, power = self._gain_to(after), 2 if self._noise == "l2" else 1
        total = float(sum((gain * error) ** power for error in self._gains_from(after)[last]))
        # Sections that mirror each other cost the same: their order must not be left to the rounding of spectra.
        return float(f"{total:.{_ROUGH_DIGITS if self._rough else _DIGITS}g}")

    def _product(self, placed: _Placed) -> Spectrum:
        spectrum = np.ones(self._length // 2 + 1, dtype=np.complex128)
        for pole in _members(placed[0]):
            spectrum = spectrum * self._all_pole[pole]
        for zero in _members(placed[1]):
            spectrum = spectrum * self._numerators[zero]
        return spectrum

    def _gain_to_uncached(self, after: _Placed) -> float:
        return self._norm(self._product(after), self._scale)

    def _gains_from_uncached(self, after: _Placed) -> dict[int, list[float]]:
        behind = self._product((self._full & ~after[0], self._full & ~after[1]))
        return {
            pole: [
                self._norm(behind * self._all_pole[pole] * self._spectrum(error), self._noise)
                for error in self._sections[pole].noise
            ]
            for pole in _members(after[0])
        }

    def _norm(self, spectrum: Spectrum, norm: Norm) -> float:
        if norm == "linf":
            return float(np.abs(spectrum).max())
        if norm == "l1":
            spectrum = spectrum.astype(np.complex64) if self._rough else spectrum
            return float(np.abs(np.fft.irfft(spectrum, self._length)).sum())
        power = np.abs(spectrum) ** 2
        return math.sqrt(float(2 * power.sum() - power[0] - power[-1]) / self._length)


def _members(mask: int) -> Iterator[int]:
    return (k for k in range(mask.bit_length()) if mask >> k & 1)
