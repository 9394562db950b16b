"""Follows the start of a filter symbolically: what its first sample x0 makes of all later ones.

The stage is computed twice. At the first sample after a reset every state is 0, and every node is a form
``a x + b x0 + c`` of the sample, which is x0 itself. That gives the next states. With these, and any other sample x, it
is computed again: each state must keep the value it has, so that by induction it does at every later sample. The stage
must then hand on 0 at the first sample and ``x - x0`` at all later ones, and beside it x0, if that is needed.

Behind it the sections see ``x - x0``: for each x0 a value within a window as wide as the range of x, with 0 in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

from sosmith.verify.certificate_file import NodeEntry, Operation, StageEntry
from sosmith.verify.graph import inputs_of, label, require


@dataclass(frozen=True)
class Start:
    """What a proven start hands on.

    Attributes
    ----------
    low, high : Fraction
        Range of the samples, and of x0.
    passes : bool
        Whether x0 passes beside the sections.
    """

    low: Fraction
    high: Fraction
    passes: bool

    @property
    def size(self) -> Fraction:
        """Largest magnitude of x0."""
        return max(-self.low, self.high)

    @property
    def windows(self) -> list[tuple[Fraction, Fraction]]:
        """Windows of ``x - x0`` for the lowest and the highest x0; all others lie between them."""
        span = self.high - self.low
        return [(Fraction(0), span), (-span, Fraction(0))]


class _Form(NamedTuple):
    """``x * sample + first * x0 + rest``."""

    x: Fraction
    first: Fraction
    rest: Fraction

    def plus(self, other: _Form, factor: Fraction | int = 1) -> _Form:
        return _Form(*(a + factor * b for a, b in zip(self, other, strict=True)))

    def times(self, factor: Fraction) -> _Form:
        return _Form(*(factor * part for part in self))


_ZERO = Fraction(0)
_NOTHING = _Form(_ZERO, _ZERO, _ZERO)
_SAMPLE = _Form(Fraction(1), _ZERO, _ZERO)
_FIRST = _Form(_ZERO, Fraction(1), _ZERO)


def check_start(stage: StageEntry) -> Start:
    """Prove that a stage takes its first sample off all samples.

    Raises
    ------
    RejectedError
        If it does anything else.
    """
    count = len(inputs_of(stage)), len(stage.outputs)
    require(count in {(1, 1), (1, 2)}, f"{stage.name} must have one input and one or two outputs, not {count}")
    node = stage.nodes[inputs_of(stage)[0]]
    low, high = (Fraction(code) * Fraction(2) ** -node.frac for code in (node.low, node.high))
    delays = [index for index, one in enumerate(stage.nodes) if one.op is Operation.DELAY]
    states = dict.fromkeys(delays, _NOTHING)
    before = _computed(stage, _FIRST, states, (low, high))
    kept = {index: before[stage.nodes[index].operands[0]] for index in delays}
    after = _computed(stage, _SAMPLE, kept, (low, high))
    for index in delays:
        following = after[stage.nodes[index].operands[0]]
        require(following == kept[index], f"{label(stage, index)} must keep what the first sample gave it")
    wanted = [(_NOTHING, _SAMPLE.plus(_FIRST, -1)), (_FIRST, _FIRST)]
    for index, (first, later) in zip(stage.outputs, wanted, strict=False):
        what = "0 and then every sample less the first one" if later is wanted[0][1] else "the first sample"
        require((before[index], after[index]) == (first, later), f"{label(stage, index)} must be {what}")
    return Start(low, high, len(stage.outputs) == 2)


def _computed(
    stage: StageEntry, sample: _Form, states: dict[int, _Form], ends: tuple[Fraction, Fraction]
) -> list[_Form]:
    """Compute all nodes for a sample, and check the ranges that BOUND nodes state."""
    forms: list[_Form] = []
    for index, node in enumerate(stage.nodes):
        operands = [forms[i] for i in node.operands if node.op is not Operation.DELAY]
        if node.op is Operation.INPUT:
            forms.append(sample)
        elif node.op is Operation.DELAY:
            forms.append(states[index])
        else:
            forms.append(_form(stage, index, operands))
        if node.op is Operation.BOUND:
            _check_bound(stage, index, forms[-1], ends)
    return forms


def _form(stage: StageEntry, index: int, operands: Sequence[_Form]) -> _Form:
    node = stage.nodes[index]
    if node.op is Operation.CONSTANT:
        return _NOTHING._replace(rest=node.parameter * Fraction(2) ** -node.frac)
    if node.op is Operation.BOUND:
        return operands[0]
    if node.op in {Operation.ADD, Operation.SUBTRACT}:
        return operands[0].plus(operands[1], 1 if node.op is Operation.ADD else -1)
    require(node.op is Operation.MULTIPLY, f"{label(stage, index)} must not be in a start stage")
    for one, other in (operands, operands[::-1]):
        if one[:2] == _NOTHING[:2]:
            return other.times(one.rest)
    require(False, f"{label(stage, index)} must not multiply samples with each other")
    raise AssertionError


def _check_bound(stage: StageEntry, index: int, form: _Form, ends: tuple[Fraction, Fraction]) -> None:
    """Check that a form keeps to a node's range, for all samples and first samples between `ends`."""
    node = stage.nodes[index]
    unit = Fraction(2) ** node.frac
    low, high = (
        (form.rest + sum(side(factor * end for end in ends) for factor in form[:2])) * unit for side in (min, max)
    )
    require(
        node.low <= low and high <= node.high,
        f"{label(stage, index)} must hold {float(low):.17g}..{float(high):.17g}, not {node.low}..{node.high}",
    )


def section_alone(stage: StageEntry) -> StageEntry:
    """Return a section without what passes beside it.

    Raises
    ------
    RejectedError
        If its last input is not passed on as its last output, or is used for anything else.
    """
    last = len(stage.nodes) - 1
    node: NodeEntry = stage.nodes[last]
    users = [one for one in stage.nodes if last in one.operands]
    require(
        node.op is Operation.INPUT and not users and stage.outputs[-1] == last and stage.outputs.count(last) == 1,
        f"{stage.name} must pass on the first sample as its last input and output, and use it for nothing else",
    )
    return stage.model_copy(update={"nodes": stage.nodes[:last], "outputs": stage.outputs[:-1]})
