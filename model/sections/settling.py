"""Which samples come before a filter that started from zero has settled, counted channel by channel.

A saturating counter, written with the operations that every architecture has. With N samples to wait for and a power
of two that is at least N::

    sample      n = 0    1    ..   N-1   N    N+1  ..
    counted         0    1    ..   N-1   N    N    ..    the state: = counted - settling, one sample later
    settling       -1   -1    ..   -1    0    0    ..    = floor((counted - N) / power), one bit: its sign

The state is cleared like all others: by a reset, at a channel's start, and when the core recovers from a fault.

>>> from sosmith.model.dataflow.graph import GraphBuilder
>>> g = GraphBuilder()
>>> flag = settling(g, 3)
>>> g.build([flag]).run([[]] * 5)
[[-1], [-1], [-1], [0], [0]]
"""

from __future__ import annotations

from sosmith.model.dataflow.graph import GraphBuilder, Wire


def settling(g: GraphBuilder, samples: int) -> Wire:
    """Add the counter to a graph; return what is -1 for the first `samples` samples, at least one, and then 0."""
    counted = g.delay("counted", 0, 0, samples)
    left = g.subtract(counted, g.constant(samples, 0, "samples"))
    power = max((samples - 1).bit_length(), 1)
    flag = g.floor(g.shift(left, -power), 0, "settling")
    g.connect(counted, g.bound(g.subtract(counted, flag), 0, samples, "counted_next"))
    return flag
