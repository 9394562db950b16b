"""Finds which words of a program hold which states of a graph, by running both on the same samples.

Which state is in which words, and with how many additional fraction bits, is read off the numbers of a run: at every
sample, the words hold the state times the same power of two. States come first in the memory. A state that no words
hold is the floor of another one: a program keeps y(n-1) of a section with all its fraction bits, and reads x(n-1) of
the next section there.

This is a guess, which the checker proves: see `sosmith.gen.verifier.program.check`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from sosmith.gen.verifier.certificate_file import Certificate
from sosmith.gen.verifier.program.graph_forms import Graph
from sosmith.gen.verifier.program.run import Machine, samples
from sosmith.gen.verifier.program.text import ProgramText

_SAMPLES = 32
_MOST_DIGITS = 8


@dataclass(frozen=True)
class State:
    """A state of the graph in the words of a program: code * 2**shift, in digits.

    Attributes
    ----------
    node : int
        The DELAY in the joined graph.
    address, digits : int
        Its lowest word, and number of words.
    shift : int
        Fraction bits beyond those of the node.
    """

    node: int
    address: int
    digits: int
    shift: int


def find_states(program: ProgramText, graph: Graph, certificate: Certificate) -> tuple[list[State], dict[int, int]]:
    """Guess where a program keeps the states of a graph.

    Returns
    -------
    list of State, dict of int to int
        States in words, in the order of their addresses; and each state that is the floor of one of them.
    """
    words: list[list[int]] = []
    states = dict.fromkeys(graph.delays, 0)
    series: dict[int, list[int]] = {node: [] for node in graph.delays}
    machine = Machine(program, certificate)
    for codes in samples(certificate, _SAMPLES):
        words.append(machine.words[:, 0].tolist())
        for node, past in series.items():
            past.append(states[node])
        graph.step(codes, states)
        machine.step(codes)
    found: list[State] = []
    floors: dict[int, int] = {}
    address = 0
    while True:
        held = {state.node for state in found}
        floors = _floors(graph, series, held)
        left = [node for node in series if node not in held and node not in floors]
        tried = (_matched(program, graph, words, address, node, series[node]) for node in left)
        state = next((state for state in tried if state is not None), None)
        if state is None:
            break
        found.append(state)
        address += state.digits
    free = sorted({*range(program.words - 1)} - {s.address + k for s in found for k in range(s.digits)})
    found += [State(node, at, 1, 0) for node, at in zip(left, free, strict=False)]
    return sorted(found, key=lambda state: state.address), floors


def _matched(
    program: ProgramText, graph: Graph, words: Sequence[Sequence[int]], address: int, node: int, codes: list[int]
) -> State | None:
    """Match a state with as many words, from an address on, as its range needs."""
    bits, entry = program.digit_bits, graph.nodes[node].entry
    for count in range(1, min(_MOST_DIGITS, program.words - 1 - address) + 1):
        past = [sum(row[address + k] << (bits * k) for k in range(count)) for row in words]
        shift = _shift(past, codes)
        if (
            shift is not None
            and -1 << (bits * count) <= entry.low << shift
            and entry.high << shift < 1 << (bits * count)
        ):
            return State(node, address, count, shift)
    return None


def _floors(graph: Graph, series: Mapping[int, list[int]], held: set[int]) -> dict[int, int]:
    """Find the states that are the floor of one of those in words, at every sample."""
    floors = {}
    for node in series.keys() - held:
        for other in sorted(held):
            shift = graph.nodes[other].entry.frac - graph.nodes[node].entry.frac
            if shift >= 0 and all(b >> shift == a for a, b in zip(series[node], series[other], strict=True)):
                floors[node] = other
                break
    return floors


def _shift(past: Sequence[int], codes: Sequence[int]) -> int | None:
    """Return the s with ``past == codes * 2**s`` throughout, if there is one that is not negative."""
    ratios = {Fraction(a, b) for a, b in zip(past, codes, strict=True) if b}
    if len(ratios) > 1 or any(a and not b for a, b in zip(past, codes, strict=True)):
        return None
    ratio = ratios.pop() if ratios else Fraction(1)
    shift = ratio.numerator.bit_length() - 1
    return shift if ratio == 1 << max(shift, 0) else None
