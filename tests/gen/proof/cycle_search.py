"""Exhaustive search for the limit cycles of small sections, beside which the bounds are checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from math import prod

from sosmith.gen.proof.limit_cycles import loop_states
from sosmith.model.dataflow.graph import Graph, value

_MAX_STARTS = 1 << 20


@dataclass(frozen=True, kw_only=True)
class Cycles:
    """What a search has found.

    Attributes
    ----------
    starts : int
        States that it began from.
    amplitude : Fraction
        Largest magnitude of the output in any cycle that they end in, in the units of the output.
    longest : int
        Samples of the longest such cycle; 1 for a constant output.
    """

    starts: int
    amplitude: Fraction
    longest: int


def search_cycles(graph: Graph, reach: int, *, fraction_bits: int | None = None) -> Cycles:
    """Run a section without input from every state of its loop within `reach`.

    Exact, on the integer graph. Its ranges should be wide, as they are until a proof narrows them.

    Parameters
    ----------
    graph : Graph
        The section.
    reach : int
        Largest magnitude of a state at the start, in LSBs of the output.
    fraction_bits : int or None
        How much finer than LSBs of the output the starts are spaced; None for every code. Without error feedback
        the bits below are never read, and 0 loses nothing.

    Raises
    ------
    ValueError
        If these are more than a million states.
    RangeError
        If a code leaves the range that its node states.
    """
    loop = loop_states(graph)
    output = graph.nodes[graph.outputs[0]]
    starts = []
    for k in loop:
        finer = graph.nodes[graph.delays[k]].frac - output.frac
        step = 1 if fraction_bits is None else 1 << max(finer - fraction_bits, 0)
        most = (reach << max(finer, 0)) // step
        starts.append([step * n for n in range(-most, most + 1)])
    count = prod(map(len, starts))
    if count > _MAX_STARTS:
        raise ValueError(f"starts must be at most {_MAX_STARTS}, not {count}")
    known: set[tuple[int, ...]] = set()
    amplitude, longest = Fraction(0), 1
    for codes in product(*starts):
        state = graph.reset()
        for k, code in zip(loop, codes, strict=True):
            state[k] = code
        cycle = _cycle_from(graph, state, known)
        longest = max(longest, len(cycle))
        amplitude = max([amplitude, *cycle])
    return Cycles(starts=count, amplitude=amplitude, longest=longest)


def cycle_from(graph: Graph, state: Sequence[int]) -> list[Fraction]:
    """Magnitudes of the output over one period of the cycle that a section ends in without input."""
    return _cycle_from(graph, list(state), set())


def _cycle_from(graph: Graph, state: list[int], known: set[tuple[int, ...]]) -> list[Fraction]:
    """Add the states passed to `known`; an empty list if one of them was known before."""
    output = graph.nodes[graph.outputs[0]]
    path: dict[tuple[int, ...], int] = {}
    magnitudes: list[Fraction] = []
    key = tuple(state)
    while key not in path and key not in known:
        path[key] = len(magnitudes)
        (code,) = graph.step([0], state)
        magnitudes.append(abs(value(output, code)))
        key = tuple(state)
    known.update(path)
    return magnitudes[path[key] :] if key in path else []
