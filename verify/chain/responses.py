"""The exact response of a chain's stages, from their certificates, and bounds of what it lets through.

A stage is filters with zeros before them and R-th results behind them, written as parts. Parts of which none puts in
zeros behind one that leaves results out have one response at the highest of their rates: that of a part is spread by
what lies between. Numerators are multiplied exactly. Each denominator is inverted by itself
(`sosmith.verify.bounds.l1_response`), and errors of the inverses add up to

    |N| ((|h1| + e1) (|h2| + e2) .. - |h1| |h2| ..)

in the sum of magnitudes. With zeros before, a result has only taps that are so many apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from math import gcd
from operator import mul

from flint import fmpq, fmpq_poly, fmpz_poly

from sosmith.verify.bounds.l1_response import inverse
from sosmith.verify.certificate_file import Certificate, PortEntry, SectionEntry
from sosmith.verify.graph import require

_MOST_TAPS = 1 << 22
"""Longest response that is computed."""


@dataclass(frozen=True)
class Part:
    """Ideal sections behind `rise` - 1 zeros for each sample, of whose results every `factor`-th leaves."""

    sections: tuple[SectionEntry, ...]
    factor: int
    rise: int = 1


@dataclass(frozen=True)
class Run:
    """Parts one behind the other, of which none puts in zeros behind one that leaves results out.

    `rate` is that of the samples that enter, in units of the chain's.
    """

    parts: tuple[Part, ...]
    rate: Fraction

    @property
    def rise(self) -> int:
        """By how much the rate goes up first."""
        return reduce(mul, (part.rise for part in self.parts), 1)

    @property
    def factor(self) -> int:
        """By how much it goes down then."""
        return factor_of(self.parts)

    def spread(self) -> list[tuple[SectionEntry, int]]:
        """Return the sections, and how many samples at the highest rate are one of theirs."""
        up, down, sections = 1, 1, []
        for part in self.parts:
            up *= part.rise
            sections += [(section, self.rise // up * down) for section in part.sections]
            down *= part.factor
        return sections


def runs_of(parts: Sequence[Part]) -> list[Run]:
    """Return runs of parts, each as long as it can be."""
    runs, start, rate, lowered = list[Run](), 0, Fraction(1), False
    for k, part in enumerate(parts):
        if part.rise > 1 and lowered:
            runs.append(Run(tuple(parts[start:k]), rate))
            rate, start, lowered = rate * runs[-1].rise / runs[-1].factor, k, False
        lowered = lowered or part.factor > 1
    return [*runs, Run(tuple(parts[start:]), rate)] if parts else runs


def parts_of(cores: Sequence[Certificate]) -> tuple[Part, ...]:
    """Return what the ideals of a stage's cores do; nothing for a polynomial."""
    if len(cores) > 1:
        return (_in_turn(cores),)
    (certificate,) = cores
    sections = certificate.ideal.sections
    if certificate.decimation is not None:
        return _cic(certificate.decimation.factor, certificate.decimation.stages), Part(sections, 1)
    down = certificate.downsampling
    return (Part(sections, 1 if down is None else down.factor),) if sections else ()


def taps_in_turn(cores: Sequence[Certificate]) -> tuple[Fraction, ...]:
    """Return the taps of which each core has every so many-th, without zeros at the end.

    Raises
    ------
    RejectedError
        If the ideal of a core is anything but taps.
    """
    phases = []
    for core in cores:
        sections = core.ideal.sections
        plain = len(sections) == 1 and list(sections[0].denominator) == [Fraction(1)]
        require(
            plain and core.decimation is None and (core.downsampling is None or core.downsampling.factor == 1),
            f"the core {core.name}, one of several, must be a filter of taps",
        )
        phases.append(sections[0].numerator)
    taps = [Fraction(0)] * (len(phases) * max(map(len, phases)))
    for k, phase in enumerate(phases):
        for n, tap in enumerate(phase):
            taps[n * len(phases) + k] = tap
    return tuple(taps[: max((n + 1 for n, tap in enumerate(taps) if tap), default=1)])


def _in_turn(cores: Sequence[Certificate]) -> Part:
    section = SectionEntry.model_construct(numerator=taps_in_turn(cores), denominator=(Fraction(1),))
    return Part((section,), 1, len(cores))


def _cic(factor: int, stages: int) -> Part:
    """Return a CIC filter, by the powers of its moving sum, in pieces that a section can have."""
    ones = tuple(Fraction(1, factor) for _ in range(factor))
    return Part(
        tuple(SectionEntry.model_construct(numerator=ones, denominator=(Fraction(1),)) for _ in range(stages)), factor
    )


def factor_of(parts: Sequence[Part]) -> int:
    """Return by how much parts leave results out."""
    return reduce(mul, (part.factor for part in parts), 1)


def rise_of(parts: Sequence[Part]) -> int:
    """Return by how much parts put in zeros."""
    return reduce(mul, (part.rise for part in parts), 1)


def peak_gain(parts: Sequence[Part], *, steady: bool) -> Fraction:
    """Bound how much of an error before parts one behind the other is in any result: run by run.

    With `steady`, parts start as if the first sample of each had been there for ever.
    """
    return reduce(mul, map(_from_steady if steady else _peak_gain, runs_of(parts)), Fraction(1))


def _from_steady(run: Run) -> Fraction:
    """Bound the gain of a run whose parts start from their own first samples.

    A constant x is the only input for which it matters how the parts start, as none of the other samples is known at
    the start. If it had been there for ever, results of a part that puts in zeros would take turns, and the part behind
    would know of all of them; it takes the first one, w, for all. Let v and u be the results with either start of the
    parts up to one of them, x being 1, with abs(v - u) <= e from the start on, and abs(u - w) <= d before it, where w
    is the first u. The part behind, of the gain N, had v(start) before it, at most e + d from u, so that its results
    differ by at most N (e + d). What it makes of w alone has one value for each zero put in, and of u - w at most N d.
    """
    whole = _peak_gain(run)
    if run.rise == 1:
        return whole
    gains = [_peak_gain(Run((part,), Fraction(1))) for part in run.parts]
    e = d = Fraction(0)
    largest = Fraction(1)
    for part, gain in zip(run.parts, gains, strict=True):
        values = [sum(part.sections[0].numerator[k :: part.rise], Fraction(0)) for k in range(part.rise)]
        apart = max(abs(value - values[0]) for value in values) if part.rise > 1 else Fraction(0)
        e, d = gain * (e + d), gain * d * 2 + largest * apart
        largest *= gain
    return min(whole + e, largest)


def _peak_gain(run: Run) -> Fraction:
    """Bound the largest sum of the magnitudes of taps that are `rise` apart, from above."""
    sections = run.spread()
    _check_length(1 + sum((len(section.numerator) - 1) * step for section, step in sections))
    numerator, under = fmpq_poly([1]), dict[int, fmpq_poly]()
    for section, step in sections:
        numerator *= _spread(section.numerator, step)
        if len(section.denominator) > 1:
            under[step] = under.get(step, fmpq_poly([1])) * _spread(section.denominator, 1)
    samples, scale, exact, wide = numerator.numer(), Fraction(1, int(numerator.denom())), Fraction(1), Fraction(1)
    own = _norm(samples) * scale
    for spread, polynomial in under.items():
        one = inverse(polynomial)
        size = _norm(one.samples) / (1 << one.bits)
        exact, wide = exact * size, wide * (size + one.error)
        _check_length(len(samples) + len(one.samples) * spread)
        apart = one.samples(fmpz_poly([0] * spread + [1])) if spread > 1 else one.samples
        samples, scale = samples * apart, scale / (1 << one.bits)
    magnitudes = [abs(int(sample)) for sample in samples.coeffs()]
    largest = max(sum(magnitudes[k :: run.rise]) for k in range(0, run.rise, gcd(run.rise, run.factor)))
    return Fraction(largest) * scale + own * (wide - exact)


def _check_length(samples: int) -> None:
    require(samples <= _MOST_TAPS, f"the response of a chain must have at most {_MOST_TAPS} samples")


def _norm(samples: fmpz_poly) -> Fraction:
    return Fraction(sum(abs(int(sample)) for sample in samples.coeffs()))


def _spread(taps: Sequence[Fraction], step: int) -> fmpq_poly:
    spread = [fmpq(0)] * ((len(taps) - 1) * step + 1)
    spread[::step] = [fmpq(tap.numerator, tap.denominator) for tap in taps]
    return fmpq_poly(spread)


def reach_of(certificate: Certificate) -> Fraction:
    """Bound the exact magnitude that enters the first filter of a chain: the input, or a polynomial of the inputs."""
    polynomial, ends = certificate.ideal.polynomial, [_largest(port) for port in certificate.inputs]
    if polynomial is None:
        return ends[0]
    v, t = ends
    return sum((abs(a) * v**i * t**j for i, row in enumerate(polynomial) for j, a in enumerate(row)), Fraction(0))


def _largest(port: PortEntry) -> Fraction:
    return max(abs(port.zero + port.lsb * code) for code in (port.lowest, port.highest))
