"""The start of a filter from the steady state of its first sample: what is taken off before its sections.

A filter with the response h of its states at zero starts as if its input had been 0 for ever. It starts as if its first
sample x0 had been there for ever if x0 is taken off before the sections, and G x0 added behind them, with the gain G at
zero frequency: the response to ``x - x0`` begins at rest, and G x0 is the steady response to x0::

            +-------+  change   +----------+         +----------+  y    +--------------+
    x ----->| start |---------->| section0 |-- .. -->| sectionN |------>| output_stage |---> code
            |       |   held    |  (passes |         |   held   |------>|  y + G held  |
            +-------+---------->|   held)  |-- .. -->|   by)    |       +--------------+
                                +----------+         +----------+

The stage remembers x0, and whether there was a sample. Both are 0 after a reset, as every state is::

    sample                n = 0    1        2
    started               0        1        1
    first                 0        x(0)     x(0)
    change                0        x(1)-x0  x(2)-x0    = started * x - first
    held                  x(0)     x0       x0         = x - change; the next `first`

>>> stage = StartStage(x=Range(0, -8, 7), passes=True)
>>> stage.graph.run([[5], [7], [-8]])
[[0, 5], [2, 5], [-13, 5]]
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from sosmith.model.dataflow.graph import Graph, GraphBuilder, Node, Op, Range
from sosmith.model.dataflow.structure import Stage


@dataclass(frozen=True, kw_only=True)
class StartStage:
    """Takes its first sample off every sample; a stage of a datapath.

    Attributes
    ----------
    x : Range
        Range of the input.
    passes : bool
        Whether it passes on the first sample, too: not before a filter whose gain at zero frequency is 0.
    """

    x: Range
    passes: bool
    name: str = "start"

    @cached_property
    def graph(self) -> Graph:
        """The stage as a dataflow graph with the input ``x`` and the outputs ``change`` and, if passed on, ``held``."""
        g = GraphBuilder()
        frac, low, high = self.x
        span = high - low
        x = g.input("x", *self.x)
        started = g.delay("started", 0, 0, 1)
        g.connect(started, g.constant(1, 0))
        first = g.delay("first", frac, low, high)
        change = g.subtract(g.multiply(x, started, "since"), first)
        change = g.bound(change, -span, span, "change")
        held = g.bound(g.subtract(x, change), low, high, "held")
        g.connect(first, held)
        return g.build([change, held] if self.passes else [change])


@dataclass(frozen=True, kw_only=True)
class PassingStage:
    """A stage of a filter, and beside it a value that passes on to the next stage; a stage of a datapath.

    Attributes
    ----------
    section : Stage
        The stage.
    held : Range
        Range of the value.
    """

    section: Stage
    held: Range

    @property
    def name(self) -> str:
        """Name of the stage."""
        return self.section.name

    @cached_property
    def graph(self) -> Graph:
        """The stage's graph with one more input and output at the end, which are the same node ``held``."""
        graph = self.section.graph
        node = Node(Op.INPUT, (), *self.held, name="held")
        return Graph((*graph.nodes, node), (*graph.inputs, len(graph.nodes)), (*graph.outputs, len(graph.nodes)))
