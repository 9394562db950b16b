"""Sections with scattered look-ahead: a recursion that goes back M samples at once, so that it has M clocks.

Numerator and denominator of a section are multiplied by the same polynomials, one for each doubling (Parhi and
Messerschmitt 1989, the decomposition into powers of two). With ``A(w) = 1 + a1 w + a2 w**2`` and w = 1/z::

    A(w) A(-w) = 1 + (2 a2 - a1**2) w**2 + a2**2 w**4

Its poles are the squares of those of A, in powers of w**2. After log2 M such steps, the denominator is one in powers
of w**M, and as stable as before. The polynomials that were multiplied stand in front of the recursion, without
feedback::

    x --> B(w) --[u0]--> A(-w) --[u1]--> A2(-w**2) --[u2]--> .. --> + --[v]--------+--> y
                                                                    ^              |
                                                                    +-- -A1, -A2 <-+-- w**M, w**2M

Each bracket is a quantizer; a half is added before it to centre its error. What is rounded behind the last of them
passes the recursion alone, whose gain is far smaller than that of 1/A. The coefficients of every step are rounded on
their own. The zeros then no longer lie exactly on the poles that were added; that is part of the error of the
coefficients, and is proven with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

from sosmith.model.dataflow.graph import Graph, GraphBuilder, Range, Wire
from sosmith.model.sections.direct_form import Product

Limits = tuple[int, int]
"""Smallest and largest code."""


class Tap(NamedTuple):
    """One multiplication: ``coefficient * 2**-frac`` times the value `delay` samples ago."""

    name: str
    coefficient: int
    frac: int
    delay: int

    @property
    def value(self) -> Fraction:
        """Exact value of the coefficient."""
        return Fraction(self.coefficient, 1 << self.frac)


@dataclass(frozen=True, kw_only=True)
class LookAhead:
    """A first- or second-order section with scattered look-ahead; a stage of a datapath.

    Attributes
    ----------
    name : str
        Name of the section.
    numerator : tuple of Product
        Products of B, with taps on x alone.
    factors : tuple of tuple of Tap
        Each polynomial in front of the recursion, without its leading one.
    recursion : tuple of Tap
        The denominator likewise: ``1 + A1 w**M + A2 w**2M``.
    x : Range
        Range of the input.
    fracs : tuple of int
        Most fraction bits that u0, u1, .. keep.
    ranges : tuple of tuple of int
        Ranges of the codes of u0, u1, .. before their quantizers, from peak gains.
    y_frac : int
        Fraction bits of the output.
    v_range : tuple of int
        Range of the code of v, from peak gains.
    """

    name: str
    numerator: tuple[Product, ...]
    factors: tuple[tuple[Tap, ...], ...]
    recursion: tuple[Tap, ...]
    x: Range
    fracs: tuple[int, ...]
    ranges: tuple[Limits, ...]
    y_frac: int
    v_range: Limits

    def __post_init__(self) -> None:
        first, second = self._feedback
        if abs(second) >= 1 or abs(first) >= 1 + second:
            raise ValueError(
                f"poles must lie inside the unit circle, not at {float(-first):.6g}, {float(second):.6g} (sum, product)"
            )

    @property
    def _feedback(self) -> tuple[Fraction, Fraction]:
        """A1 and A2."""
        least = self.distance
        values = {tap.delay // least: tap.value for tap in self.recursion}
        return values.get(1, Fraction(0)), values.get(2, Fraction(0))

    @property
    def distance(self) -> int:
        """Samples M that the recursion goes back at once."""
        return 1 << len(self.factors)

    @property
    def coefficients(self) -> dict[str, tuple[int, int]]:
        """Integer and fraction bits of every coefficient, by name."""
        taps = [tap for factor in (*self.factors, self.recursion) for tap in factor]
        numerator = {p.name: (p.coefficient, p.frac) for p in self.numerator}
        return numerator | {tap.name: (tap.coefficient, tap.frac) for tap in taps}

    @property
    def optional_quantizers(self) -> tuple[str, ...]:
        """Names of the nodes that may be quantized but need not be: none."""
        return ()

    @cached_property
    def stated_fracs(self) -> dict[str, int]:
        """Fraction bits of the nodes with a stated range, by name, which follow without the graph."""
        frac = max(self.x.frac + p.frac + p.shift - _least_zeros(p.x) for p in self.numerator)
        fracs = {}
        for k, kept in enumerate(self.fracs):
            fracs[f"u{k}"] = frac
            frac = min(frac, kept)
            taps = self.factors[k] if k < len(self.factors) else ()
            frac = max([frac, *(frac + tap.frac for tap in taps)])
        return fracs | {"v": max([frac, *(self.y_frac + tap.frac for tap in self.recursion)])}

    @cached_property
    def graph(self) -> Graph:
        """The section as a dataflow graph with the input ``x`` and the output ``y``."""
        g = GraphBuilder()
        x = g.input("x", *self.x)
        before = [x, *_delayed(g, x, "x", max(max(k for k in range(3) if p.x[k]) for p in self.numerator))]
        terms = []
        for p in self.numerator:
            operand = g.combine(list(zip(p.x, before, strict=False)), p.operand if p.is_sum else "")
            terms.append((1, g.shift(g.scale(operand, p.coefficient, p.frac, f"product_{p.name}"), -p.shift)))
        wire = self._quantized(g, g.combine(terms), 0)
        for k, taps in enumerate(self.factors, start=1):
            past = _delayed(g, wire, f"x{k}", max((tap.delay for tap in taps), default=0))
            wire = self._quantized(g, g.combine([(1, wire), *_products(g, taps, past)]), k)
        limits = (end >> (self.stated_fracs["v"] - self._kept) for end in self.v_range)
        first = g.delay("y_1", self._kept, *limits)
        past = [first, *_delayed(g, first, "y", max((tap.delay for tap in self.recursion), default=1) - 1, 1)]
        total = self.stated_fracs["v"]
        half = [(1, g.constant(1, self._kept + 1, "half_v"))] if total > self._kept else []
        # The newest sample comes last: what is added to it before is there in time.
        products = [(-sign, product) for sign, product in _products(g, self.recursion[::-1], past)]
        v = g.bound(g.combine([(1, wire), *half, *products]), *self.v_range, "v")
        y = g.floor(v, self._kept, "y")
        g.connect(first, y)
        return g.build([y])

    @property
    def _kept(self) -> int:
        """Fraction bits of y."""
        return min(self.y_frac, self.stated_fracs["v"])

    def _quantized(self, g: GraphBuilder, total: Wire, k: int) -> Wire:
        """State the range of u0, u1, .., and quantize it."""
        kept = min(self.fracs[k], g[total].frac)
        return g.floor(g.bound(_halved(g, total, kept, f"half_u{k}"), *self.ranges[k], f"u{k}"), kept, f"u{k}_kept")


def _halved(g: GraphBuilder, total: Wire, kept: int, name: str) -> Wire:
    """Add what centres the error of a quantizer that drops bits."""
    return g.add(total, g.constant(1, kept + 1, name)) if g[total].frac > kept else total


def _products(g: GraphBuilder, taps: Sequence[Tap], past: Sequence[Wire]) -> list[tuple[int, Wire]]:
    """Products of a signal's past, whose first value is one sample old, as positive terms of a sum."""
    return [(1, g.scale(past[tap.delay - 1], tap.coefficient, tap.frac, f"product_{tap.name}")) for tap in taps]


def _delayed(g: GraphBuilder, wire: Wire, name: str, count: int, before: int = 0) -> list[Wire]:
    """Return a signal one to `count` samples ago."""
    samples: list[Wire] = []
    for k in range(1, count + 1):
        samples.append(g.previous(samples[-1] if samples else wire, f"{name}_{before + k}"))
    return samples


def _least_zeros(taps: Sequence[int]) -> int:
    """Trailing zeros of all taps together: bits by which their sum is coarser than what it is made of."""
    return min((tap & -tap).bit_length() - 1 for tap in taps if tap)
