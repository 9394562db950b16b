"""The last stage of a datapath: from output LSBs with guard bits to the output code, limited to its range.

Behind a filter that starts from its first sample it adds what was taken off before the sections
(`sosmith.model.sections.start`). Behind one that starts from zero it tells which samples come before that has settled
(`sosmith.model.sections.settling`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from sosmith.model.dataflow.graph import Graph, GraphBuilder, Range
from sosmith.model.sections.settling import settling


@dataclass(frozen=True, kw_only=True)
class FirstSample:
    """The first sample, as it arrives beside the filter's output, and the gain with which it is added there.

    Attributes
    ----------
    range : Range
        Its range, in output LSBs.
    gain, gain_frac : int
        Gain of the filter at zero frequency, in units of ``2**-gain_frac``; not 0.
    """

    range: Range
    gain: int
    gain_frac: int

    @property
    def is_plain(self) -> bool:
        """Whether the gain is 1: it takes no multiplier."""
        return self.gain == 1 << self.gain_frac


@dataclass(frozen=True, kw_only=True)
class OutputStage:
    """Adds an offset, rounds to whole output LSBs, and saturates; a stage of a datapath.

    Attributes
    ----------
    offset, offset_frac : int
        What is added before rounding: minus the lower end of the range, in units of ``2**-offset_frac`` output LSBs.
    x : Range
        Range of the input, in output LSBs.
    low, high : int
        Range of the output code; the only saturation in a datapath.
    held : FirstSample or None
        The first sample of a filter that starts from it; None if none is passed on.
    settling : int
        Number of samples after a start that are flagged as settling; 0 without the flag.
    """

    offset: int
    offset_frac: int
    x: Range
    low: int
    high: int
    held: FirstSample | None = None
    settling: int = 0
    name: str = "output_stage"

    @cached_property
    def graph(self) -> Graph:
        """The stage as a dataflow graph.

        Its inputs are ``x``, and ``held`` if there is one; its outputs the code, and what is -1 while the filter
        settles if that is flagged.
        """
        g = GraphBuilder()
        flags = [settling(g, self.settling)] if self.settling else []  # first: what is limited has to come last
        x = g.input("x", *self.x)
        half = False
        if self.held is not None:
            held = g.input("held", *self.held.range)
            half = self.held.is_plain and self.held.range.frac <= 0 < self.x.frac
            if half:  # what rounds the total has room below the bits of an integer
                held = g.add(held, g.constant(1, 1))
            plain = self.held.is_plain
            x = g.add(x, held if plain else g.scale(held, self.held.gain, self.held.gain_frac, "steady"), "total")
        if self.offset:
            x = g.add(x, g.constant(self.offset, self.offset_frac, "offset"))
        rounded = g.floor(x, 0, "rounded") if half else g.round(x, 0, "rounded")
        if self.low <= g[rounded].low and g[rounded].high <= self.high:
            return g.build([rounded, *flags])
        return g.build([g.clamp(rounded, self.low, self.high, "code"), *flags])
