"""Limit cycles of a certificate's recursions, from their graphs: bounds on them, and whether there are none.

- No limit cycle without input is larger than what the quantizers can do at most: each error is at its worst at every
  sample, weighted by the magnitudes of the response to it.
- The error of a constant output is at most the same with constant errors, weighted by the gains at zero frequency.
- There is none if x^T D x, with a diagonal D > 0, falls with every sample, which it does if D - A^T D A is positive
  definite, and if quantizers can only reduce the magnitude of each state. Of two states with weights d1 and d2, the
  best ratio makes d1 a12^2 = d2 a21^2; where one of a12 and a21 is 0, a small share of the other state's weight does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any

from sosmith.verify.bounds.driven_responses import Denominator, magnitude
from sosmith.verify.certificate_file import Operation, PortEntry
from sosmith.verify.verdict.figures import Figure
from sosmith.verify.verdict.recursions import Recursion

_SUMS = Fraction(1, 2**36)
"""Share of a sum of magnitudes that one who sums it up in another way may be off by."""

_SHARES = 400
"""Powers of two that are tried as the weight of a state that does not feed the other."""


def limit_cycles_of(part: Recursion, output: PortEntry) -> dict[str, Any]:
    """Return what a manifest has to say of the limit cycles of a recursion, in the unit of the core's output."""
    transfer = part.transfer
    over = Denominator(transfer.denominator)
    errors = [
        (transfer.numerator(source, part.output), *ends)
        for source, ends in transfer.sources.items()
        if source[0] is not Operation.INPUT
    ]
    largest = magnitude(over, errors) * output.lsb
    ends = [sorted(over.total(numerator) * end for end in both) for numerator, *both in errors]
    dead_band = max(-sum((low for low, _ in ends), Fraction(0)), sum((high for _, high in ends), Fraction(0)))
    weights = _weights(part.loop_matrix)
    return {
        "section": part.name,
        "largest": Figure(largest, largest * _SUMS, largest * _SUMS),
        "dead_band": Figure(dead_band * output.lsb),
        "none": weights is not None and _only_reduces(part),
        "lyapunov": None if weights is None else [str(weight) for weight in weights],
    }


def _weights(matrix: Sequence[Sequence[Fraction]]) -> tuple[Fraction, ...] | None:
    """Return the first D that proves that all states of a loop die away; None if none does."""
    return next((weights for weights in _candidates(matrix) if _falls(weights, matrix)), None)


def _candidates(matrix: Sequence[Sequence[Fraction]]) -> Iterator[tuple[Fraction, ...]]:
    one = Fraction(1)
    if len(matrix) < 2:
        yield (one,) * len(matrix)
    elif len(matrix) == 2:
        a12, a21 = abs(matrix[0][1]), abs(matrix[1][0])
        if a12 and a21:
            yield one, a12 / a21
            return
        for k in range(_SHARES if a12 or a21 else 1):
            yield (one / 2**k, one) if a12 else (one, one / 2**k)


def _falls(weights: Sequence[Fraction], matrix: Sequence[Sequence[Fraction]]) -> bool:
    """Whether ``D - A^T D A`` is positive definite: its leading minors, of one or two rows, are positive."""
    size = range(len(matrix))
    rest = [
        [weights[i] * (i == j) - sum(matrix[k][i] * weights[k] * matrix[k][j] for k in size) for j in size]
        for i in size
    ]
    if len(matrix) == 2 and rest[0][0] * rest[1][1] - rest[0][1] * rest[1][0] <= 0:
        return False
    return not rest or rest[0][0] > 0


def _only_reduces(part: Recursion) -> bool:
    """Whether quantizers can only reduce what each state in a loop takes over."""
    nodes, states = part.stage.nodes, part.transfer.states
    return all(_reduced(part, nodes[states[k]].operands[0]) for k in part.loop)


def _reduced(part: Recursion, index: int) -> bool:
    """Whether a node is no larger than the exact one: a truncated sum of states, or a multiple of such a value."""
    nodes = part.stage.nodes
    while nodes[index].op is Operation.BOUND:
        index = nodes[index].operands[0]
    if nodes[index].op is Operation.TRUNCATE:
        index = nodes[index].operands[0]
    pending, states, truncated = [index], 0, set[int]()
    while pending:
        current = pending.pop()
        node = nodes[current]
        if node.op in {Operation.FLOOR, Operation.FRACTION} or (node.op is Operation.CONSTANT and node.parameter):
            return False
        if node.op is Operation.TRUNCATE:
            truncated.add(current)
        elif node.op is Operation.DELAY:
            states += 1
        else:
            pending += node.operands
    return not truncated or (not states and len(truncated) == 1 and _reduced(part, truncated.pop()))
