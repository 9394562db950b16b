"""How long a start from zero shows at the output of a cascade of sections."""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache

from sosmith.gen.proof.fading import Fading, Pair
from sosmith.gen.proof.peak_gain import Extent
from sosmith.model.dataflow.graph import Graph

SETTLED = Fraction(1, 2)
"""Effect of all that was before a start from zero on the output at which it counts as over, in output LSBs."""


@lru_cache(maxsize=64)
def settling(sections: tuple[Graph, ...]) -> int:
    """Count the samples after a start from zero until `SETTLED` bounds what any other states there would change.

    So long the output may be further from that of a filter with another past, such as one that has run for ever.

    Parameters
    ----------
    sections : tuple of Graph
        The sections, at least one.

    Raises
    ------
    ShortfallError
        If that is not proven to come to an end.
    """
    fading = Fading(SETTLED)
    for number, graph in enumerate(sections):
        pair = Pair(graph, graph, f"section{number}")
        none = dict.fromkeys(pair.differences.values(), Extent(Fraction(0), Fraction(0)))
        fading.section(number, pair, none, watched=False)
    fading.watch_outputs()
    return fading.samples
