"""The exact response of a chain's stages, from their certificates, and bounds of what it lets through.

A stage is filters with R-th results between them, written as parts. Parts one behind the other have one response at the
rate of the first: that of a part is spread by the product of the factors before it. Numerators are multiplied exactly.
Each denominator is inverted by itself (`sosmith.verify.bounds.l1_response`), and errors of the inverses add up to

    |N| ((|h1| + e1) (|h2| + e2) .. - |h1| |h2| ..)

in the sum of magnitudes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, reduce
from operator import mul

from flint import fmpq, fmpq_poly, fmpz_poly

from sosmith.verify.bounds.l1_response import Inverse, inverse
from sosmith.verify.certificate_file import Certificate, PortEntry, SectionEntry
from sosmith.verify.graph import require

_MOST_TAPS = 1 << 22
"""Longest response that is computed."""


@dataclass(frozen=True)
class Part:
    """Ideal sections, of whose results every `factor`-th leaves."""

    sections: tuple[SectionEntry, ...]
    factor: int


def parts_of(certificate: Certificate) -> tuple[Part, ...]:
    """Return what the ideal of a stage does; nothing for a polynomial."""
    sections = certificate.ideal.sections
    if certificate.decimation is not None:
        return _cic(certificate.decimation.factor, certificate.decimation.stages), Part(sections, 1)
    down = certificate.downsampling
    return (Part(sections, 1 if down is None else down.factor),) if sections else ()


@cache
def _cic(factor: int, stages: int) -> Part:
    """Return a CIC filter, by the powers of its moving sum, in pieces that a section can have."""
    ones = tuple(Fraction(1, factor) for _ in range(factor))
    return Part(
        tuple(SectionEntry.model_construct(numerator=ones, denominator=(Fraction(1),)) for _ in range(stages)), factor
    )


def factor_of(parts: Sequence[Part]) -> int:
    """Return the number of samples for each result."""
    return reduce(mul, (part.factor for part in parts), 1)


def peak_gain(parts: Sequence[Part]) -> Fraction:
    """Bound the sum of the magnitudes of the response of parts one behind the other, from above."""
    length, step = 1, 1
    for part in parts:
        length += sum((len(section.numerator) - 1) * step for section in part.sections)
        step *= part.factor
    _check_length(length)
    numerator, step, inverses = fmpq_poly([1]), 1, list[tuple[Inverse, int]]()
    for part in parts:
        under = fmpq_poly([1])
        for section in part.sections:
            numerator *= _spread(section.numerator, step)
            under *= _spread(section.denominator, 1)
        if under.degree() > 0:
            inverses.append((inverse(under), step))
        step *= part.factor
    samples, scale, exact, wide = numerator.numer(), Fraction(1, int(numerator.denom())), Fraction(1), Fraction(1)
    own = _norm(samples) * scale
    for one, spread in inverses:
        size = _norm(one.samples) / (1 << one.bits)
        exact, wide = exact * size, wide * (size + one.error)
        _check_length(len(samples) + len(one.samples) * spread)
        apart = one.samples(fmpz_poly([0] * spread + [1])) if spread > 1 else one.samples
        samples, scale = samples * apart, scale / (1 << one.bits)
    return _norm(samples) * scale + own * (wide - exact)


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
