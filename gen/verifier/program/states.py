"""Finds which words of a program hold which states of a graph, by running both on the same samples.

A value is written digit by digit: STORE .. STORE FINISH, at addresses that follow each other. The words that are read
before they are written are states, and the instructions that write a state last say which words belong together. Which
state it is, and with how many additional fraction bits, is then read off the numbers of a run: at every sample, the
words hold the state times the same power of two.

This is a guess, which the checker proves: see `sosmith.gen.verifier.program.check`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from sosmith.gen.verifier.certificate_file import Certificate
from sosmith.gen.verifier.program.graph_forms import Graph
from sosmith.gen.verifier.program.run import Machine, samples
from sosmith.gen.verifier.program.text import ProgramText

_SAMPLES = 32
_READS = frozenset({"multiply", "operand", "product", "give"})


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


def find_states(program: ProgramText, graph: Graph, certificate: Certificate) -> list[State]:
    """Guess where a program keeps the states of a graph; in the order of the addresses."""
    blocks = _blocks(program)
    held: dict[tuple[int, int], list[int]] = {block: [] for block in blocks}
    states = dict.fromkeys(graph.delays, 0)
    series: dict[int, list[int]] = {node: [] for node in graph.delays}
    machine = Machine(program, certificate)
    for codes in samples(certificate, _SAMPLES):
        words: list[int] = machine.words[:, 0].tolist()
        for (address, count), past in held.items():
            past.append(sum(words[address + k] << (program.digit_bits * k) for k in range(count)))
        for node, past in series.items():
            past.append(states[node])
        graph.step(codes, states)
        machine.step(codes)
    return _matched(held, series)


def _blocks(program: ProgramText) -> list[tuple[int, int]]:
    """Return address and number of words of what is kept from one sample to the next."""
    written: set[int] = set()
    kept: set[int] = set()
    values: dict[int, tuple[int, int]] = {}
    first = count = 0
    for opcode, address, _ in program.instructions:
        if opcode in _READS and address not in written:
            kept.add(address)
        if opcode in {"take", "store", "finish"}:
            written.add(address)
        if opcode in {"store", "finish"}:
            first, count = (first, count + 1) if count else (address, 1)
        if opcode == "finish" and first + count <= program.words:
            values |= dict.fromkeys(range(first, first + count), (first, count))
        if opcode in {"finish", "judge"}:
            count = 0
    return sorted({values[address] for address in kept if address in values})


def _matched(held: dict[tuple[int, int], list[int]], series: dict[int, list[int]]) -> list[State]:
    """Match words with states: first where all samples agree, then what is left in order, for the message to come."""
    left = dict(series)
    found: list[State] = []
    apart: list[tuple[int, int]] = []
    for block, past in held.items():
        for node, codes in left.items():
            shift = _shift(past, codes)
            if shift is not None:
                found.append(State(node, *block, shift))
                del left[node]
                break
        else:
            apart.append(block)
    for block, (node, codes) in zip(apart, left.items(), strict=False):
        past = held[block]
        shift = min(range(40), key=lambda shift: sum(abs(a - (b << shift)) for a, b in zip(past, codes, strict=True)))
        found.append(State(node, *block, shift))
    return sorted(found, key=lambda state: state.address)


def _shift(past: Sequence[int], codes: Sequence[int]) -> int | None:
    """Return the s with ``past == codes * 2**s`` throughout, if there is one that is not negative."""
    ratios = {Fraction(a, b) for a, b in zip(past, codes, strict=True) if b}
    if len(ratios) > 1 or any(a and not b for a, b in zip(past, codes, strict=True)):
        return None
    ratio = ratios.pop() if ratios else Fraction(1)
    shift = ratio.numerator.bit_length() - 1
    return shift if ratio == 1 << max(shift, 0) else None
