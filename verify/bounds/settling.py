"""Proves for how long a filter that starts from zero is flagged as settling, and that this is long enough.

The counter of the last stage depends on nothing: it is run from reset on until its states repeat, which they then do
for ever. It must hand on -1 for the samples that are claimed, and 0 from then on.

A filter with any other past has other states at the start. The difference in each is at most as wide as its range, and
fades as the response to an impulse there does::

    |output - that with another past|  <=  sum over states of  width * |response to an impulse in the state|

This must be at most half an LSB from the claimed sample on. A state that holds a quantization error is left out: any
such error is in the bound, for either past.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import zip_longest
from math import lcm, prod

from flint import fmpq_poly

from sosmith.verify.bounds.l1_response import BITS, inverse, response
from sosmith.verify.certificate_file import NodeEntry, Operation, StageEntry
from sosmith.verify.graph import Transfer, inputs_of, label, require

SETTLED = Fraction(1, 2)
"""What may be left of any other past, in output LSBs."""

_LONGEST = 1 << 24
"""Samples of the longest response: those that a design may have, up to a far smaller rest than it looks at."""


def without_counter(stage: StageEntry, samples: int | None) -> StageEntry:
    """Prove that the last stage flags so many samples after a start; return it without what does.

    Parameters
    ----------
    stage : StageEntry
        The stage.
    samples : int or None
        The claim; None if there is none, and then there must be no flag.

    Raises
    ------
    RejectedError
        If it flags anything else, or the flag depends on the samples, or the output on the counter.
    """
    wanted = 1 if samples is None else 2
    require(
        len(stage.outputs) == wanted, f"the last stage must have {wanted} outputs as claimed, not {len(stage.outputs)}"
    )
    if samples is None:
        return stage
    counter, left = set[int](), [stage.outputs[1]]
    while left:
        index = left.pop()
        if index not in counter:
            counter.add(index)
            left += stage.nodes[index].operands
    count = len(counter)
    require(counter == set(range(count)), f"the flag of {stage.name} must depend on the first nodes alone")
    nodes = [
        node.model_copy(update={"operands": tuple(i - count for i in node.operands)}) for node in stage.nodes[count:]
    ]
    require(
        stage.outputs[0] >= count and all(i >= 0 for node in nodes for i in node.operands),
        f"the output of {stage.name} must not depend on the flag",
    )
    _check_counter(stage, count, samples)
    return stage.model_copy(update={"nodes": tuple(nodes), "outputs": (stage.outputs[0] - count,)})


def _check_counter(stage: StageEntry, count: int, samples: int) -> None:
    """Run the first nodes of a stage from reset until the states repeat, and check their ranges and the flag."""
    nodes = stage.nodes[:count]
    states = {index: 0 for index, node in enumerate(nodes) if node.op is Operation.DELAY}
    for sample in range(samples + 1):
        codes: list[int] = []
        for index, node in enumerate(nodes):
            codes.append(states[index] if node.op is Operation.DELAY else _code(stage, index, codes))
            require(
                node.low <= codes[index] <= node.high,
                f"{label(stage, index)} must stay in {node.low}..{node.high}, not be {codes[index]}",
            )
        wanted = -1 if sample < samples else 0
        flag = codes[stage.outputs[1]]
        require(flag == wanted, f"the flag of {stage.name} must be {wanted} at sample {sample}, not {flag}")
        following = {index: codes[nodes[index].operands[0]] for index in states}
        if sample == samples:
            require(following == states, f"the counter of {stage.name} must stop at sample {samples}")
        states = following


def _code(stage: StageEntry, index: int, codes: Sequence[int]) -> int:
    """Code of a node from those before it."""
    node = stage.nodes[index]
    operands = [(codes[i], stage.nodes[i].frac) for i in node.operands]
    if node.op is Operation.CONSTANT:
        return node.parameter
    if node.op in {Operation.ADD, Operation.SUBTRACT}:
        a, b = (code << (node.frac - frac) for code, frac in operands)
        return a + b if node.op is Operation.ADD else a - b
    kept = {Operation.FLOOR, Operation.SHIFT, Operation.BOUND}
    require(node.op in kept, f"{label(stage, index)} must not be in a counter")
    ((code, frac),) = operands
    return code >> (frac - node.frac) if node.op is Operation.FLOOR else code


def check_fading(sections: Sequence[StageEntry], samples: int) -> None:
    """Prove that from sample number `samples` after a start no other past changes the output by more than `SETTLED`.

    Raises
    ------
    RejectedError
        If it may.
    UndecidedError
        If a response is too long.
    """
    models = [Transfer(section) for section in sections]
    over = inverse(prod((model.denominator for model in models), start=fmpq_poly([1])), _LONGEST)
    tails: list[tuple[Fraction, list[int]]] = []
    slack = Fraction(0)
    for number, section in enumerate(sections):
        before = prod((model.denominator for model in models[:number]), start=fmpq_poly([1]))
        for entry, moved in _with_impulses(section):
            own = Transfer(moved)
            source = (Operation.INPUT, inputs_of(moved)[-1], 0)
            numerators = [own.numerator(source, output) for output in moved.outputs]
            for model in models[number + 1 :]:
                numerators = [
                    sum((n * model.numerator(i, o) for n, i in zip(numerators, model.inputs, strict=True)), fmpq_poly())
                    for o in model.stage.outputs
                ]
            reached = response(numerators[0] * before, over)
            width = (entry.high - entry.low) * Fraction(2) ** -entry.frac
            tails.append((width, reached.samples[samples + 1 :]))  # the first one is that of the impulse
            slack += width * reached.error
    scale = lcm(*(width.denominator for width, _ in tails))
    late = zip_longest(*([abs(h) * int(width * scale) for h in rest] for width, rest in tails), fillvalue=0)
    left = Fraction(max(map(sum, late), default=0), scale << BITS) + slack
    require(
        left <= SETTLED,
        f"another past must change the output by at most {SETTLED} LSB from sample {samples} after a start, "
        f"not by {float(left):.6g}",
    )


def _with_impulses(section: StageEntry) -> list[tuple[NodeEntry, StageEntry]]:
    """Return each state of a section, and the section with one more input that is added to what it takes over."""
    driven = []
    for index, node in enumerate(section.nodes):
        if node.op is not Operation.DELAY or section.nodes[node.operands[0]].op is Operation.FRACTION:
            continue
        count = len(section.nodes)
        (of,) = node.operands
        added = section.nodes[of].model_copy(update={"op": Operation.INPUT, "operands": ()})
        total = section.nodes[of].model_copy(update={"op": Operation.ADD, "operands": (of, count)})
        nodes = list(section.nodes)
        nodes[index] = node.model_copy(update={"operands": (count + 1,)})
        driven.append((node, section.model_copy(update={"nodes": (*nodes, added, total)})))
    return driven
