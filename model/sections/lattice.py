"""Lattice wave digital filters in integers: two branches of allpass sections, and half their sum or difference.

The filter is ``H = (s0 A0 + s1 A1) / 2``, s0 and s1 1 or -1, with allpass functions A0 and A1 (Gazsi 1985). Each is a
row of sections of first and second order, made of symmetric two-port adaptors: the waves a1, a2 that arrive and the
waves b1, b2 that are reflected are related by one coefficient, -1 < g < 1::

    b1 = a2 + g (a2 - a1)
    b2 = a1 + g (a2 - a1)

With a delay from b2 back to a2, an adaptor is a first-order section from a1 to b1, ``(w - g) / (1 - g w)``, w = 1/z.
With a delay and such a section in a row there, it is one of second order, with the outer g1 and the inner g2::

    (a2 + a1 w + w**2) / (1 + a1 w + a2 w**2),    a1 = g2 (g1 - 1),  a2 = -g1

Numerator and denominator have the same coefficients whatever these are rounded to: where A0 and A1 are both 1 or -1, at
zero frequency or at half the sample rate, the gain of H is exactly what it should be. A coefficient is -1, 0 or 1 plus
a small rest, and only the rest is multiplied by. For poles near z = 1 or z = -1, a few significant bits of it place
them to a small fraction of their distance from there.

The waves that enter a delay, and the one that the inner section reflects, are truncated towards zero. An adaptor
gains no energy, ``G1 a1**2 + G2 a2**2`` with port conductances in the ratio 1 - g to 1 + g, and truncation adds
none: without input a section comes to rest (Fettweis 1986). The output of a section is not part of any loop; it is
rounded to nearest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

from sosmith.model.dataflow.graph import Graph, GraphBuilder, Op, Range, Wire
from sosmith.model.sections.state_space import Coefficient

LANES = ("upper", "lower")
"""Names of the branches, and of the waves on them."""


class Adaptor(NamedTuple):
    """A coefficient g: `near`, which is -1, 0 or 1, plus the `rest`."""

    near: int
    rest: Coefficient

    @property
    def value(self) -> Fraction:
        """Exact value of g."""
        return self.near + self.rest.value


@dataclass(frozen=True, kw_only=True)
class Allpass:
    """An allpass section of first or second order, with the formats of its signals.

    Attributes
    ----------
    adaptors : tuple of Adaptor
        The only adaptor, or the outer and the inner one.
    states : tuple of Range
        Range of the wave in each adaptor's delay.
    inner : Range
        Range of the wave that the inner adaptor reflects; unused without one.
    output : Range
        Range of the output.
    """

    adaptors: tuple[Adaptor, ...]
    states: tuple[Range, ...]
    inner: Range
    output: Range

    def __post_init__(self) -> None:
        if len(self.adaptors) not in {1, 2} or len(self.states) != len(self.adaptors):
            raise ValueError(
                f"adaptors must be one or two, with as many states, not {len(self.adaptors)} and {len(self.states)}"
            )
        for adaptor in self.adaptors:
            if not abs(adaptor.value) < 1:
                raise ValueError(f"coefficients of adaptors must lie between -1 and 1, not at {float(adaptor.value)}")

    @property
    def denominator(self) -> tuple[Fraction, ...]:
        """Coefficients of ``w = 1/z``, exactly; the numerator has the same ones in reverse order."""
        outer, *rest = (adaptor.value for adaptor in self.adaptors)
        if not rest:
            return Fraction(1), -outer
        return Fraction(1), rest[0] * (outer - 1), -outer


@dataclass(frozen=True, kw_only=True)
class LatticeStage:
    """A section, or only a wire, in each of the two branches; a stage of a datapath.

    Attributes
    ----------
    name : str
        Name of the stage.
    lanes : tuple of Allpass or None
        The sections in the upper and in the lower branch; None for a wire.
    entries : tuple of Range
        Ranges of the two waves that arrive, or of the one that drives both branches.
    """

    name: str
    lanes: tuple[Allpass | None, Allpass | None]
    entries: tuple[Range, ...]

    @cached_property
    def coefficients(self) -> dict[str, tuple[int, int]]:
        """Integer and fraction bits of the rest of every adaptor's coefficient, by name."""
        return {
            name: (adaptor.rest.integer, adaptor.rest.frac)
            for lane, section in zip(LANES, self.lanes, strict=True)
            if section is not None
            for name, adaptor in zip(_names(lane, section), section.adaptors, strict=True)
        }

    @property
    def optional_quantizers(self) -> tuple[str, ...]:
        """None."""
        return ()

    @property
    def stated_fracs(self) -> dict[str, int]:
        """Fraction bits of the nodes with a stated range, by name."""
        return {node.name: node.frac for node in self.graph.nodes if node.op is Op.BOUND}

    @cached_property
    def graph(self) -> Graph:
        """The stage as a dataflow graph with the outputs ``upper_y`` and ``lower_y``.

        The waves of a section before their quantizers are named ``upper_x1_sum``, ``upper_x2_sum``,
        ``upper_inner_sum`` and ``upper_y_sum``, and behind them ``upper_x1_next``, ``upper_x2_next``, ``upper_inner``
        and ``upper_y``.
        """
        g = GraphBuilder()
        names = ("x",) if len(self.entries) == 1 else LANES
        waves = [g.input(name, *entry) for name, entry in zip(names, self.entries, strict=True)]
        return g.build(
            [
                wave if section is None else _section(g, wave, section, lane)
                for wave, section, lane in zip((waves * 2)[:2], self.lanes, LANES, strict=True)
            ]
        )


@dataclass(frozen=True, kw_only=True)
class LatticeJoin:
    """Half the sum or difference of the two branches, exactly; the last stage of the filter.

    Attributes
    ----------
    name : str
        Name of the stage.
    signs : tuple of int
        s0 and s1, each 1 or -1.
    entries : tuple of Range
        Ranges of the two waves that arrive.
    """

    name: str
    signs: tuple[int, int]
    entries: tuple[Range, Range]

    @property
    def coefficients(self) -> dict[str, tuple[int, int]]:
        """None."""
        return {}

    @property
    def optional_quantizers(self) -> tuple[str, ...]:
        """None."""
        return ()

    @property
    def stated_fracs(self) -> dict[str, int]:
        """None."""
        return {}

    @cached_property
    def graph(self) -> Graph:
        """The stage as a dataflow graph with the output ``y``."""
        g = GraphBuilder()
        waves = [g.input(name, *entry) for name, entry in zip(LANES, self.entries, strict=True)]
        return g.build([g.named(g.shift(g.combine(list(zip(self.signs, waves, strict=True))), -1), "y")])


def _names(lane: str, section: Allpass) -> tuple[str, ...]:
    return (f"{lane}_g",) if len(section.adaptors) == 1 else (f"{lane}_g1", f"{lane}_g2")


def _section(g: GraphBuilder, x: Wire, section: Allpass, lane: str) -> Wire:
    states = [g.delay(f"{lane}_x{k}", *form) for k, form in enumerate(section.states, start=1)]
    names = _names(lane, section)
    if len(section.adaptors) == 1:
        y, reflected = _adaptor(g, x, states[0], section.adaptors[0], names[0])
        waves = [reflected]
    else:
        outer, inner = section.adaptors
        through, reflected = _adaptor(g, states[0], states[1], inner, names[1])
        truncated = g.truncate(g.named(through, f"{lane}_inner_sum"), section.inner.frac)
        back = g.bound(truncated, section.inner.low, section.inner.high, f"{lane}_inner")
        y, first = _adaptor(g, x, back, outer, names[0])
        waves = [first, reflected]
    for k, (state, wave, form) in enumerate(zip(states, waves, section.states, strict=True), start=1):
        kept = g.truncate(g.named(wave, f"{lane}_x{k}_sum"), form.frac)
        g.connect(state, g.bound(kept, form.low, form.high, f"{lane}_x{k}_next"))
    if g[y].frac > section.output.frac:
        y = g.add(y, g.constant(1, section.output.frac + 1))
    rounded = g.floor(g.named(y, f"{lane}_y_sum"), section.output.frac)
    return g.bound(rounded, section.output.low, section.output.high, f"{lane}_y")


def _adaptor(g: GraphBuilder, a1: Wire, a2: Wire, adaptor: Adaptor, name: str) -> tuple[Wire, Wire]:
    """Return b1 and b2: the one that is close to a wave that arrives, and the other from b1 - b2 = a2 - a1."""
    difference = g.subtract(a2, a1)
    product = _product(g, difference, adaptor.rest, name)
    if adaptor.near > 0:
        b2 = g.combine([(1, a2), *product])
        return g.add(b2, difference), b2
    if adaptor.near < 0:
        b1 = g.combine([(1, a1), *product])
        return b1, g.subtract(b1, difference)
    return g.combine([(1, a2), *product]), g.combine([(1, a1), *product])


def _product(g: GraphBuilder, wire: Wire, by: Coefficient, name: str) -> Sequence[tuple[int, Wire]]:
    """Return the product of `wire` with a coefficient as a sign and a wire, or nothing for a coefficient of zero."""
    size = abs(by.integer)
    if not size:
        return []
    if size & (size - 1):
        product = g.scale(wire, size, by.frac, f"product_{name}")
    else:
        product = g.shift(wire, size.bit_length() - 1 - by.frac)
    return [(1 if by.integer > 0 else -1, product)]
