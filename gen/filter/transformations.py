"""Frequency transformations and the bilinear transformation: from a prototype to the digital filter's zeros and poles.

Analog frequencies are pre-warped, ``tan(pi f / sample_rate)``, so that ``z = (1 + s) / (1 - s)``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from flint import acb, arb, fmpq

from sosmith.gen.filter.prototypes import Prototype
from sosmith.model.arithmetic.correct_rounding import sign


@dataclass(frozen=True, kw_only=True)
class DigitalFilter:
    """Equal numbers of zeros and poles in the z-plane, and the gain in the pass band.

    Attributes
    ----------
    zero_cosines : tuple of arb
        Each represents a pair of zeros on the unit circle, at ``cosine +- i sqrt(1 - cosine**2)``.
    real_zeros : tuple of int
        Zeros at 1 and -1.
    real_poles : tuple of arb
    pole_pairs : tuple of acb
        The pole with the positive imaginary part of each conjugate pair.
    passing : acb
        Point on the unit circle that corresponds to the prototype's zero frequency.
    level : arb
        Gain there, positive.
    """

    zero_cosines: tuple[arb, ...]
    real_zeros: tuple[int, ...]
    real_poles: tuple[arb, ...]
    pole_pairs: tuple[acb, ...]
    passing: acb
    level: arb


def warped(frequency: Fraction, sample_rate: Fraction) -> arb:
    """Pre-warp a frequency between 0 and half the sample rate, in the same unit."""
    turns = frequency / sample_rate
    angle = fmpq(turns.numerator, turns.denominator)
    return arb.sin_pi_fmpq(angle) / arb.cos_pi_fmpq(angle)


def unwarped(edge: arb, sample_rate: Fraction) -> arb:
    """Frequency, in the sample rate's unit, that `warped` maps to `edge`."""
    return edge.atan() / arb.pi() * arb(fmpq(sample_rate.numerator, sample_rate.denominator))


def bilinear(prototype: Prototype, kind: str, edges: Sequence[arb]) -> DigitalFilter:
    """Transform a prototype to pre-warped edges, and the resulting analog filter to the z-plane.

    Parameters
    ----------
    prototype : Prototype
    kind : str
        lowpass or highpass with one edge; bandpass or bandstop with two.
    edges : sequence of arb
        Pre-warped, positive, rising.

    Raises
    ------
    UndecidedError
        If the precision is too low to decide whether two poles are real.
    """
    real, pairs, zeros, infinite = (
        prototype.real_poles,
        prototype.pole_pairs,
        prototype.zeros,
        prototype.zeros_at_infinity,
    )
    if kind in {"highpass", "bandstop"}:  # s -> 1 / s
        real = tuple(1 / pole for pole in real)
        pairs = tuple((1 / pole).conjugate() for pole in pairs)
        zeros = tuple(1 / zero for zero in zeros)
    centre: arb | None = None
    if kind in {"lowpass", "highpass"}:
        (edge,) = edges
        real = tuple(pole * edge for pole in real)
        pairs = tuple(pole * edge for pole in pairs)
        zeros = tuple(zero * edge for zero in zeros)
    else:  # s -> (s**2 + centre) / (width s): two roots of each
        low, high = edges
        centre, half = low * high, (high - low) / 2
        real, pairs = _band(tuple(pole * half for pole in real), tuple(pole * half for pole in pairs), centre)
        zeros = tuple(root for zero in zeros for root in _band_zeros(zero * half, centre))
    cosines = [_cosine(zero**2) for zero in zeros]
    if kind == "bandstop" and centre is not None:
        cosines += [_cosine(centre)] * infinite
    return DigitalFilter(
        zero_cosines=tuple(cosines),
        real_zeros={
            "lowpass": (-1,) * infinite,
            "highpass": (1,) * infinite,
            "bandpass": (-1,) * infinite + (1,) * infinite,
            "bandstop": (),
        }[kind],
        real_poles=tuple((1 + pole) / (1 - pole) for pole in real),
        pole_pairs=tuple((1 + pole) / (1 - pole) for pole in pairs),
        passing=_passing(kind, centre),
        level=prototype.dc_gain,
    )


def _band(real: Sequence[arb], pairs: Sequence[acb], centre: arb) -> tuple[tuple[arb, ...], tuple[acb, ...]]:
    """Roots s of ``s**2 - 2 q s + centre`` for every q, real or one of each conjugate pair."""
    real_roots: list[arb] = []
    pair_roots: list[acb] = []
    for q in real:
        square = q**2 - centre
        match sign(square):
            case -1:
                pair_roots.append(acb(q, (-square).sqrt()))
            case 0:
                real_roots += [q, q]
            case _:
                far = q - square.sqrt()  # q is negative: no cancellation
                real_roots += [far, centre / far]
    for pole in pairs:
        root = (pole**2 - centre).sqrt()
        for place in (pole + root, pole - root):
            pair_roots.append(place if sign(place.imag) > 0 else place.conjugate())
    return tuple(real_roots), tuple(pair_roots)


def _band_zeros(zero: arb, centre: arb) -> tuple[arb, arb]:
    """Frequencies of the two pairs of zeros that a prototype's pair of zeros is mapped to."""
    above = zero + (zero**2 + centre).sqrt()
    return above, centre / above


def _cosine(square: arb) -> arb:
    """Cosine of the angle to which the bilinear transformation maps the square root of `square`."""
    return (1 - square) / (1 + square)


def _passing(kind: str, centre: arb | None) -> acb:
    if kind == "bandpass" and centre is not None:
        return acb(_cosine(centre), 2 * centre.sqrt() / (1 + centre))
    return acb(-1 if kind == "highpass" else 1)
