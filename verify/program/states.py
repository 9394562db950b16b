"""Finds which words of a program hold which states of a graph, by running both on the same samples.

Which state is in which words, and with how many additional fraction bits, is read off the numbers of a run: at every
sample, the words hold the state times the same power of two. States come first in the memory. A state that no words
hold is the floor of another one: a program keeps y(n-1) of a section with all its fraction bits, and reads x(n-1) of
the next section there.

Behind a section that does nothing, other states are the same at every sample, but in words of their own. So there are
two guesses: that any state may be kept as a floor, or only one that takes over a FLOOR of what the other takes over.

These are guesses, which the checker proves: see `sosmith.verify.program.check`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from sosmith.verify.certificate_file import Certificate, Operation
from sosmith.verify.program.graph_forms import Graph
from sosmith.verify.program.run import Machine, samples
from sosmith.verify.program.text import ProgramText

_SAMPLES, _MOST_SAMPLES = 32, 4096
"""Samples of a run, and how many where a state is 0 until then: those of a slow filter take long to be told apart."""

_MOST_DIGITS = 8
_NEARBY = Fraction(1, 16)
"""Share of a state's largest value in the samples that a match may be away from it."""


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


def find_states(
    program: ProgramText, graph: Graph, certificate: Certificate, *, own_words: bool = False
) -> tuple[list[State], dict[int, int]]:
    """Guess where a program keeps the states of a graph; with `own_words`, as floors only what the graph says is one.

    Returns
    -------
    list of State, dict of int to int
        States in words, in the order of their addresses; and each state that is the floor of one of them.
    """
    words: list[list[int]] = []
    states = dict.fromkeys(graph.delays, 0)
    series: dict[int, list[int]] = {node: [] for node in graph.delays}
    machine = Machine(program, certificate)
    for number, codes in enumerate(samples(certificate, _MOST_SAMPLES)):
        if number >= _SAMPLES and all(map(any, series.values())):
            break
        words.append(machine.words[:, 0].tolist())
        for node, past in series.items():
            past.append(states[node])
        graph.step(codes, states)
        machine.step(codes)
    matched: list[State] = []
    floors: dict[int, int] = {}
    address = 0
    while True:
        in_words = {state.node for state in matched}
        floors = _floors(graph, series, in_words, own_words=own_words)
        left = [node for node in series if node not in in_words and node not in floors]
        tried = (_matched(program, graph, words, address, node, series[node]) for node in left)
        state = next((state for state in tried if state is not None), None)
        state = state or _nearest(program, graph, words, address, {node: series[node] for node in left})
        if state is None:
            break
        matched.append(state)
        address += state.digits
    free = sorted({*range(program.words - 1)} - {s.address + k for s in matched for k in range(s.digits)})
    matched += [State(node, at, 1, 0) for node, at in zip(left, free, strict=False)]
    return sorted(matched, key=lambda state: state.address), floors


def _matched(
    program: ProgramText, graph: Graph, words: Sequence[Sequence[int]], address: int, node: int, codes: list[int]
) -> State | None:
    """Match a state with as many words, from an address on, as its range needs."""
    for count, past in _numbers(program, words, address):
        shift = _shift(past, codes)
        if shift is not None and _fits(program, graph, State(node, address, count, shift)):
            return State(node, address, count, shift)
    return None


def _nearest(
    program: ProgramText,
    graph: Graph,
    words: Sequence[Sequence[int]],
    address: int,
    series: Mapping[int, Sequence[int]],
) -> State | None:
    """Match the state that is nearest to what words hold, from an address on; None if there is none nearby.

    A program that is wrong in a recursion by so little that its results are right is then rejected for what is wrong.
    """
    candidates: list[tuple[Fraction, State]] = []
    for count, past in _numbers(program, words, address):
        for node, codes in series.items():
            size = max(map(abs, codes), default=0)
            for shift in range(program.digit_bits * count if size else 0):
                state = State(node, address, count, shift)
                if _fits(program, graph, state):
                    apart = max(abs(a - (b << shift)) for a, b in zip(past, codes, strict=True))
                    candidates.append((Fraction(apart, size << shift), state))
    share, state = min(candidates, key=lambda pair: pair[0], default=(_NEARBY, State(-1, 0, 0, 0)))
    return state if share < _NEARBY else None


def _numbers(program: ProgramText, words: Sequence[Sequence[int]], address: int) -> Iterator[tuple[int, list[int]]]:
    """Yield what the words hold from an address on, for each number of digits: that number, and a number a sample."""
    for count in range(1, min(_MOST_DIGITS, program.words - 1 - address) + 1):
        yield count, [sum(row[address + k] << (program.digit_bits * k) for k in range(count)) for row in words]


def _fits(program: ProgramText, graph: Graph, state: State) -> bool:
    """Whether the digits of a state are enough for its range."""
    entry, limit = graph.nodes[state.node].entry, 1 << (program.digit_bits * state.digits)
    return -limit <= entry.low << state.shift and entry.high << state.shift < limit


def _floors(graph: Graph, series: Mapping[int, list[int]], in_words: set[int], *, own_words: bool) -> dict[int, int]:
    """Find the states that are the floor of one of those in words, at every sample.

    Slow sections look alike in the samples of a run: a floor by the graph comes before what only looks like one.
    """
    floors = {}
    for node in series.keys() - in_words:
        for other in sorted(in_words, key=lambda other: (not _takes_floor(graph, node, other), other)):
            shift = graph.nodes[other].entry.frac - graph.nodes[node].entry.frac
            same = shift >= 0 and all(b >> shift == a for a, b in zip(series[node], series[other], strict=True))
            if same and (not own_words or _takes_floor(graph, node, other)):
                floors[node] = other
                break
    return floors


def _takes_floor(graph: Graph, node: int, other: int) -> bool:
    """Whether a state takes over a FLOOR of what another takes over, or both repeat such states."""
    (source,), (larger,) = (graph.nodes[state].entry.operands for state in (node, other))
    while graph.nodes[source].entry.op is graph.nodes[larger].entry.op is Operation.DELAY:
        (source,), (larger,) = (graph.nodes[state].entry.operands for state in (source, larger))
    return graph.nodes[source].entry.op is Operation.FLOOR and graph.nodes[source].entry.operands == (larger,)


def _shift(past: Sequence[int], codes: Sequence[int]) -> int | None:
    """Return the s with ``past == codes * 2**s`` throughout, if there is one that is not negative."""
    ratios = {Fraction(a, b) for a, b in zip(past, codes, strict=True) if b}
    if len(ratios) > 1 or any(a and not b for a, b in zip(past, codes, strict=True)):
        return None
    ratio = ratios.pop() if ratios else Fraction(1)
    shift = ratio.numerator.bit_length() - 1
    return shift if ratio == 1 << max(shift, 0) else None
