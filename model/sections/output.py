"""The last stage of a datapath: from output LSBs with guard bits to the output code, limited to its range."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from sosmith.model.dataflow.graph import Graph, GraphBuilder, Range


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
    """

    offset: int
    offset_frac: int
    x: Range
    low: int
    high: int
    name: str = "output_stage"

    @cached_property
    def graph(self) -> Graph:
        """The stage as a dataflow graph with the input ``x`` and the output ``code``."""
        g = GraphBuilder()
        x = g.input("x", *self.x)
        if self.offset:
            x = g.add(x, g.constant(self.offset, self.offset_frac, "offset"))
        rounded = g.round(x, 0, "rounded")
        if self.low <= g[rounded].low and g[rounded].high <= self.high:
            return g.build([rounded])
        return g.build([g.clamp(rounded, self.low, self.high, "code")])
