"""Recursions with scattered look-ahead: they go back M samples at once, so that they have M clocks.

The denominator of a section is multiplied by a polynomial that makes of it one in powers of ``w**M``, with w = 1/z. Its
poles are the M-th powers of those of the section, so that it is as stable as before. The filter's numerator times these
polynomials stands in front (`sosmith.gen.realizations.look_ahead`), without feedback, as one FIR filter. For a large M
that would have many taps; the section then doubles its M a few times more. With ``A(w) = 1 + a1 w + a2 w**2``, of which
w is a power of 1/z already (Parhi and Messerschmitt 1989, the decomposition into powers of two)::

    A(w) A(-w) = 1 + (2 a2 - a1**2) w**2 + a2**2 w**4

    x --[u0]--> A(-w) --[u1]--> A2(-w**2) --[u2]--> .. --> + --[v]--------+--> y
                                                           ^              |
                                                           +-- -A1, -A2 <-+-- z**-M, z**-2M

Each bracket is a quantizer; without such polynomials, that is v alone. A half is added before it to centre its error.
Products may drop bits too (`sosmith.model.sections.floored_products`), as many as the bracket does or fewer; a bracket
with nothing left to drop takes no half.
What is rounded behind the last of them passes the recursion alone, whose gain is far smaller than that of 1/A. The
coefficients of every step are rounded on their own. The zeros then no longer lie exactly on the poles that were added;
that is part of the error of the coefficients, and is proven with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

from sosmith.model.dataflow.graph import Graph, GraphBuilder, Range, Wire
from sosmith.model.sections.floored_products import directions, factors, shortened

Limits = tuple[int, int]
"""Smallest and largest code."""

_BLOCK_BITS = 18
"""Bits of a multiplier block's operand, signed: of the widest one that FPGAs here have."""

_MOST_BEYOND = 8
"""Bits that a constant has more than a block at most, if it is taken apart."""


class Tap(NamedTuple):
    """One multiplication: ``coefficient * 2**-frac`` times the value `delay` samples ago.

    Of the product, `floored` fraction bits are kept; None keeps all.
    """

    name: str
    coefficient: int
    frac: int
    delay: int
    floored: int | None = None

    def kept(self, frac: int) -> int:
        """Fraction bits of the product of a value with `frac` fraction bits."""
        exact = frac + self.frac
        return exact if self.floored is None else min(exact, self.floored)

    @property
    def label(self) -> str:
        """Name of the product."""
        return f"product_{self.name}"

    @property
    def value(self) -> Fraction:
        """Exact value of the coefficient."""
        return Fraction(self.coefficient, 1 << self.frac)


@dataclass(frozen=True, kw_only=True)
class LookAhead:
    """The recursion of a first- or second-order section with scattered look-ahead; a stage of a datapath.

    Attributes
    ----------
    name : str
        Name of the section.
    distance : int
        Samples M that the recursion goes back at once.
    factors : tuple of tuple of Tap
        Each polynomial in front of the recursion, without its leading one.
    recursion : tuple of Tap
        The denominator likewise: ``1 + A1 z**-M + A2 z**-2M``.
    x : Range
        Range of the input.
    fracs : tuple of int
        Most fraction bits that u0, u1, .. keep; empty without factors.
    ranges : tuple of tuple of int
        Ranges of the codes of u0, u1, .. before their quantizers, from peak gains.
    y_frac : int
        Fraction bits of the output.
    v_range : tuple of int
        Range of the code of v, from peak gains.
    """

    name: str
    distance: int
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
        values = {tap.delay // self.distance: tap.value for tap in self.recursion}
        return values.get(1, Fraction(0)), values.get(2, Fraction(0))

    @property
    def coefficients(self) -> dict[str, tuple[int, int]]:
        """Integer and fraction bits of every coefficient, by name."""
        return {tap.name: (tap.coefficient, tap.frac) for tap in self._taps}

    @property
    def optional_quantizers(self) -> tuple[str, ...]:
        """Names of the nodes that may be quantized but need not be: the products."""
        return tuple(tap.label for tap in self._taps)

    @property
    def _taps(self) -> tuple[Tap, ...]:
        return tuple(tap for polynomial in (*self.factors, self.recursion) for tap in polynomial)

    @cached_property
    def stated_fracs(self) -> dict[str, int]:
        """Fraction bits of the nodes with a stated range, by name, which follow without the graph."""
        frac = self.x.frac
        fracs = {}
        for k, kept in enumerate(self.fracs):
            fracs[f"u{k}"] = frac
            frac = min(frac, kept)
            taps = self.factors[k] if k < len(self.factors) else ()
            frac = max([frac, *(tap.kept(frac) for tap in taps)])
        return fracs | {"v": max([frac, *(tap.kept(self.y_frac) for tap in self.recursion)])}

    @cached_property
    def graph(self) -> Graph:
        """The section as a dataflow graph with the input ``x`` and the output ``y``."""
        g = GraphBuilder()
        wire = g.input("x", *self.x)
        for k in range(len(self.fracs)):
            if k:
                taps = self.factors[k - 1]
                past = _delayed(g, wire, f"x{k}", max((tap.delay for tap in taps), default=0))
                wire = g.combine([(1, wire), *_products(g, taps, past, 1)])
            wire = self._quantized(g, wire, k)
        limits = (end >> (self.stated_fracs["v"] - self._kept) for end in self.v_range)
        first = g.delay("y_1", self._kept, *limits)
        past = [first, *_delayed(g, first, "y", max((tap.delay for tap in self.recursion), default=1) - 1, 1)]
        total = self.stated_fracs["v"]
        half = [(1, g.constant(1, self._kept + 1, "half_v"))] if total > self._kept else []
        # The newest sample comes last: what is added to it before is there in time.
        products = _products(g, self.recursion[::-1], past, -1)
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


def _products(g: GraphBuilder, taps: Sequence[Tap], past: Sequence[Wire], sign: int) -> list[tuple[int, Wire]]:
    """Products of a signal's past, whose first value is one sample old, as terms of a sum that all have a sign."""
    shorter = [tap for tap in taps if tap.kept(g[past[0]].frac) < g[past[0]].frac + tap.frac]
    parts = [part for tap in shorter for part in _parts(tap, sign)]
    ways = directions([part.coefficient for part in parts])
    plain = [
        (sign, g.scale(past[tap.delay - 1], tap.coefficient, tap.frac, tap.label)) for tap in taps if tap not in shorter
    ]
    return plain + [
        shortened(g, past[part.delay - 1], part.coefficient, part.frac, part.kept(g[past[0]].frac), part.label, way)
        for part, way in zip(parts, ways, strict=True)
    ]


def _parts(tap: Tap, sign: int) -> list[Tap]:
    """Return the taps that make one, times a sign: two if its constant is a little longer than a block takes."""
    whole = tap._replace(coefficient=sign * tap.coefficient)
    upper, dropped, rest = factors(whole.coefficient, _BLOCK_BITS)
    if not (rest and dropped <= min(tap.frac, _MOST_BEYOND)):
        return [whole]
    return [
        whole._replace(name=f"{tap.name}_rest", coefficient=rest),
        whole._replace(coefficient=upper, frac=tap.frac - dropped),
    ]


def _delayed(g: GraphBuilder, wire: Wire, name: str, count: int, before: int = 0) -> list[Wire]:
    """Return a signal one to `count` samples ago."""
    samples: list[Wire] = []
    for k in range(1, count + 1):
        samples.append(g.previous(samples[-1] if samples else wire, f"{name}_{before + k}"))
    return samples
