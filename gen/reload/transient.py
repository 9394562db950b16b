"""The transient after a swap of constants: the values of internal signals, and how long it lasts.

The new set starts from states of the old one. Suppose the old set kept running in parallel on the same input. Applied
to the states and input of this old run, the new set's equations give next states and outputs that differ from the old
ones. These differences are driven by the input through the old set alone, so exact responses bound them. Every signal
in the new run is the sum of two parts: the result of these equations, and the response of the new set, from the swap
on, to the differences. With A, B of the old set and A', B' of the new one::

    x'(n+1) - x(n+1) = A' (x'(n) - x(n)) + (A' - A) x(n) + (B' - B) u(n),    x'(0) - x(0) = 0

So the bound is small if the sets are close to each other, however slow the filter is. The errors of each quantizer may
differ between the two runs, which drives the difference too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from sosmith.gen.proof.cascade_proof import INPUT, Drives, Lane
from sosmith.gen.proof.fading import Codes, Fading, Pair, added, merged
from sosmith.gen.proof.linear_model import linear_models
from sosmith.gen.proof.peak_gain import Drive, extent
from sosmith.gen.proof.response import IMPULSE
from sosmith.gen.word_lengths.quantized import Quantized


@dataclass(frozen=True, kw_only=True)
class Transient:
    """Proven facts about a swap.

    Attributes
    ----------
    ranges : tuple of dict of str to (int, int)
        For each section, the range of codes of its inputs and BOUND nodes, by name, at any time before or after the
        swap.
    samples : int
        Number of samples after which `RESIDUE` bounds the remaining effect on every state and on the output.
    """

    ranges: tuple[dict[str, Codes], ...]
    samples: int


def transient(active: Quantized, other: Quantized, first_range: tuple[Fraction, Fraction] | None = None) -> Transient:
    """Bound all signals when `other` takes over from `active`, at any sample and for all inputs in range.

    An earlier swap may have left an error of up to `RESIDUE` in every state.

    Parameters
    ----------
    active, other : Quantized
        Filters in the same number of sections, with the same states.
    first_range : (Fraction, Fraction) or None
        Range of the first samples that may be held, which contains that of all samples; None for filters that start
        from zero.

    Raises
    ------
    ShortfallError
        If their states differ.
    """
    pairs = [Pair(a.graph, b.graph, b.name) for a, b in zip(active.sections, other.sections, strict=True)]
    if first_range is None:
        return _transient(pairs, *_input_values(active, other))
    # Whatever is held, the samples less that lie in a window of this width that contains 0, and limits are linear in
    # where it lies.
    span, zero = first_range[1] - first_range[0], Fraction(0)
    above, below = _transient(pairs, zero, span), _transient(pairs, -span, zero)
    ranges = tuple(
        {name: (min(a[name][0], b[name][0]), max(a[name][1], b[name][1])) for name in a}
        for a, b in zip(above.ranges, below.ranges, strict=True)
    )
    (entry,) = pairs[0].active.inputs
    node = pairs[0].active.nodes[entry]
    widest = math.ceil(span * Fraction(2) ** node.frac)
    ranges[0][node.name] = -widest, widest
    return Transient(ranges=ranges, samples=max(above.samples, below.samples))


def _transient(pairs: Sequence[Pair], low: Fraction, high: Fraction) -> Transient:
    """Bound all signals for inputs of the first section in [low, high]."""
    wires: list[Drives] = [{INPUT: Drive(IMPULSE, low, high)}]
    fading = Fading()
    ranges = []
    for number, pair in enumerate(pairs):
        lanes = [Lane(number, model, wires) for model in linear_models(pair.together)]
        outputs = [lane.at(lane.model.output) for lane in lanes]
        starts = {lane.model.output: extent(list(d.values())) for lane, d in zip(lanes, outputs, strict=True)}
        limits = {node: extent(list(lane.at(pair.place[node]).values())) for node, lane in pair.bounds(lanes).items()}
        moved = fading.section(number, pair, starts)
        count = len(pair.active.outputs)
        wires = [merged(drives, {INPUT}, (number, k, "rounding", 0)) for k, drives in enumerate(outputs[:count])]
        ranges.append(pair.ranges({node: added(limits[node], moved[node]) for node in limits}))
    return Transient(ranges=tuple(ranges), samples=fading.samples)


def _input_values(active: Quantized, other: Quantized) -> tuple[Fraction, Fraction]:
    """Smallest and largest value at the input of the first section."""
    nodes = [quantized.sections[0].graph.nodes[quantized.sections[0].graph.inputs[0]] for quantized in (active, other)]
    units = [Fraction(2) ** -node.frac for node in nodes]
    return (
        min(node.low * unit for node, unit in zip(nodes, units, strict=True)),
        max(node.high * unit for node, unit in zip(nodes, units, strict=True)),
    )
