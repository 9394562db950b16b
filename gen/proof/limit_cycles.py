"""Limit cycles and dead bands of a section.

Without input, the quantizers of a recursion can keep it from coming to rest, and a small constant input can have
no effect. Three properties are derived from a section's dataflow graph.

- The largest output that its quantizers can sustain: all errors are at their worst at every sample, and weighted by
  the exact gains of the proof. It bounds every limit cycle. With one rounding quantizer it is half an LSB times the
  peak gain from there to the output.
- The dead band: the same for constant errors, with the gains at zero frequency. A constant output can be this far
  from its exact value. Error feedback has a zero at zero frequency.
- Whether limit cycles are impossible: with a diagonal D > 0 for which D - A^T D A is positive definite, x^T D x falls
  with every sample, and no quantizer that only reduces the magnitude of each state (magnitude truncation) can raise
  it. Where the states overflow, the same D excludes overflow oscillations (Mills, Mullis and Roberts 1978). D and its
  proof are in rationals.

In a section with several outputs, each output is analysed by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

from sosmith.gen.proof.linear_model import LinearModel, cone, linear_model, state_matrix
from sosmith.gen.proof.peak_gain import Drive, extent
from sosmith.gen.proof.response import IMPULSE
from sosmith.model.dataflow.graph import Graph, Op
from sosmith.model.dataflow.structure import Stage

Matrix = Sequence[Sequence[Fraction]]

_MIN_SHARE = 400  # of the weight of one state in a triangular matrix, as a power of two


def recursions(section: Stage) -> dict[str, Graph]:
    """Recursions of a section by name, each with one input and one output.

    A section with one input and one output is its own recursion. Otherwise there is one for each output that depends
    on a state: the part of the graph that leads to that output.
    """
    graph = section.graph
    if len(graph.inputs) == len(graph.outputs) == 1:
        return {section.name: graph}
    parts = {f"{section.name} {graph.nodes[output].name}": cone(graph, output)[0] for output in graph.outputs}
    return {name: part for name, part in parts.items() if part.delays}


@dataclass(frozen=True, kw_only=True)
class LimitCycles:
    """Limit cycles of a section, in the units of its output.

    Attributes
    ----------
    largest : Fraction
        Proven bound on the output's magnitude in every limit cycle without input, and on its distance from the
        exact response to any input after the start-up transient.
    dead_band : Fraction
        Largest error that a constant output can have.
    lyapunov : tuple of Fraction or None
        Diagonal D of the certificate, one entry per state in the loop; None if there is none.
    none : bool
        Whether it is proven that the section comes to rest without input: there is a certificate, and all
        quantizers in the loop are magnitude truncations, of the states or on the only path to one.
    """

    largest: Fraction
    dead_band: Fraction
    lyapunov: tuple[Fraction, ...] | None
    none: bool


@lru_cache(maxsize=256)
def limit_cycles(graph: Graph) -> LimitCycles:
    """Find the limit cycles that the quantizers of a section can sustain.

    Raises
    ------
    ValueError
        If the graph is not linear, or has not one input and one output.
    ShortfallError
        If the section is unstable.
    """
    model = linear_model(graph)
    certificate = lyapunov_diagonal(loop_matrix(graph))
    return LimitCycles(
        largest=_largest(model),
        dead_band=_dead_band(model),
        lyapunov=certificate,
        none=certificate is not None and _only_truncates_states(graph),
    )


def _largest(model: LinearModel) -> Fraction:
    own = IMPULSE.all_pole(model.denominator)
    drives = [Drive(own.taps(s.numerators[model.output]), s.low, s.high) for s in model.sources[1:]]
    return extent(drives).magnitude


def _dead_band(model: LinearModel) -> Fraction:
    low = high = Fraction(0)
    for source in model.sources[1:]:
        gain = sum(source.numerators[model.output], Fraction(0)) / sum(model.denominator, Fraction(0))
        ends = gain * source.low, gain * source.high
        low, high = low + min(ends), high + max(ends)
    return max(-low, high)


def loop_states(graph: Graph) -> tuple[int, ...]:
    """Positions, among the graph's delays, of those in a loop; the others decay to zero by themselves."""
    # Bit j of row i: a path leads from state j to state i (S. Warshall, "A theorem on Boolean matrices", 1962).
    rows = [sum(bool(entry) << j for j, entry in enumerate(row)) for row in state_matrix(graph)]
    for k in range(len(rows)):
        rows = [row | rows[k] if row >> k & 1 else row for row in rows]
    return tuple(k for k, row in enumerate(rows) if row >> k & 1)


def loop_matrix(graph: Graph) -> list[list[Fraction]]:
    """Rows and columns of `state_matrix` that belong to states in a loop."""
    matrix, states = state_matrix(graph), loop_states(graph)
    return [[matrix[i][j] for j in states] for i in states]


def is_positive_definite(matrix: Matrix) -> bool:
    """Whether a symmetric matrix of rationals is positive definite: all pivots of its L D L^T are positive."""
    rows = [list(row) for row in matrix]
    for k, row in enumerate(rows):
        if row[k] <= 0:
            return False
        for other in rows[k + 1 :]:
            factor = other[k] / row[k]
            for j in range(k, len(rows)):
                other[j] -= factor * row[j]
    return True


def proves_decay(diagonal: Sequence[Fraction], matrix: Matrix) -> bool:
    """Whether ``x^T D x`` falls with every step ``x' = A x``: D and D - A^T D A are positive definite."""
    size = len(matrix)
    difference = [
        [
            (diagonal[i] if i == j else Fraction(0))
            - sum((matrix[k][i] * diagonal[k] * matrix[k][j] for k in range(size)), Fraction(0))
            for j in range(size)
        ]
        for i in range(size)
    ]
    return all(entry > 0 for entry in diagonal) and is_positive_definite(difference)


def lyapunov_diagonal(matrix: Matrix) -> tuple[Fraction, ...] | None:
    """Find a diagonal D that `proves_decay`; None if there is none, or for more than two states.

    With two states, D = diag(|a21|, |a12|) makes the cross terms of ``sqrt(D) A / sqrt(D)`` equal in size. No other
    ratio is better, so only this one is tried, unless a cross term is zero. In that case, D can make the other as small
    as necessary.
    """
    if len(matrix) > 2:
        return None
    if len(matrix) < 2:
        candidates = [(Fraction(1),) * len(matrix)]
    else:
        a12, a21 = abs(matrix[0][1]), abs(matrix[1][0])
        if a12 and a21:
            candidates = [(Fraction(1), a12 / a21)]
        else:
            shares = [Fraction(1, 1 << k) for k in range(_MIN_SHARE if a12 or a21 else 1)]
            candidates = [(share, Fraction(1)) if a12 else (Fraction(1), share) for share in shares]
    return next((diagonal for diagonal in candidates if proves_decay(diagonal, matrix)), None)


def _only_truncates_states(graph: Graph) -> bool:
    delays = graph.delays
    return all(_never_grows(graph, graph.nodes[delays[k]].operands[0]) for k in loop_states(graph))


def _never_grows(graph: Graph, index: int) -> bool:
    """Whether quantization can only reduce a node's magnitude.

    The node must be a sum of multiples of states, or a multiple of one value that is itself truncated, and must
    either be truncated or not be quantized.
    """
    index = _unbounded(graph, index)
    if graph.nodes[index].op is Op.TRUNCATE:
        index = graph.nodes[index].operands[0]
    pending, states, truncated = [index], 0, set[int]()
    while pending:
        current = pending.pop()
        node = graph.nodes[current]
        if node.op in {Op.FLOOR, Op.FRACTION} or (node.op is Op.CONSTANT and node.parameter):
            return False
        if node.op is Op.TRUNCATE:
            truncated.add(current)
        elif node.op is Op.DELAY:
            states += 1
        else:
            pending += node.operands
    return not truncated or (not states and len(truncated) == 1 and _never_grows(graph, truncated.pop()))


def _unbounded(graph: Graph, index: int) -> int:
    while graph.nodes[index].op is Op.BOUND:
        index = graph.nodes[index].operands[0]
    return index
