"""The flags that leave a parallel core with a sample: what each of them must be."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple, Protocol

from sosmith.verify.certificate_file import Certificate, Operation
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.parallel.forms import Forms, shifted
from sosmith.verify.parallel.graph_codes import GraphCodes, LanePorts
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import Form, constant, plus
from sosmith.verify.specified.words import words_of

_AT_RAIL, _OUTSIDE, _SATURATED, _WEAR, _SETTLING, _NONE = 0, 1, 2, (3, 4), 5, (6, 7)
"""Bits of the flags of a sample; those of `_NONE` are 0 without protection."""

Limits = tuple[Form, Form]
"""The least codes at which wear is a warning and critical."""


class Flag(NamedTuple):
    """A flag: its bit, its name, and what it must be; one that a core does not have has no name and is 0."""

    place: int
    name: str
    value: Form


class ConstantWords(Protocol):
    """What words of memories that never change are, as forms."""

    @property
    def forms(self) -> Forms:
        """The atoms."""

    def constant_word(self, name: str) -> Form:
        """Return the word of a memory for the channel of a sample."""


def wear_limits(pipeline: ConstantWords, netlist: Netlist, certificate: Certificate, prefix: str) -> Limits | None:
    """Return the limits of wear for the channel of a sample; None if wear is not judged, or nothing says whether it is.

    Raises
    ------
    RejectedError
        If channels have limits of their own, and there is no memory of them.
    """
    item = None if certificate.about is None else certificate.about.item
    if item is None or not item.wear:
        return None
    if len(item.wear) == 1:
        return constant(item.wear[0][0]), constant(item.wear[0][1])
    name, bits = f"{prefix}wear_limits", certificate.output.bits
    memory = netlist.memories.get(name)
    if memory is None:
        raise RejectedError(f"a core whose channels have limits of their own must have a memory {name}")
    mask = (1 << bits) - 1
    words = tuple((low & mask) | (high & mask) << bits for low, high in item.wear)
    right = memory.first == words and memory.width == 2 * bits
    require(right, f"{name} must hold the limits of all channels")
    word = pipeline.constant_word(name)
    forms = pipeline.forms
    low, high = (forms.floor(shifted(word, -bits * k)) for k in range(2))
    if certificate.output.signed:
        return forms.signed(low, bits), forms.signed(high, bits)
    return forms.unsigned(low, bits), forms.unsigned(high, bits)


def flags_of(
    graph: GraphCodes, lane: LanePorts, certificate: Certificate, input_flags: Sequence[Form], limits: Limits | None
) -> Iterator[Flag]:
    """Yield the flags of a sample, as far as the certificate says what they are.

    Parameters
    ----------
    graph : GraphCodes
    lane : LanePorts
        Of the sample.
    certificate : Certificate
    input_flags : sequence of Form
        Flags of the inputs that come with a sample.
    limits : Limits or None
        Those of wear.
    """
    item = None if certificate.about is None else certificate.about.item
    settling = {} if lane.settling is None else graph.forms.negative(graph.codes[lane.settling])
    yield Flag(_AT_RAIL, "input_at_rail", input_flags[0] if input_flags else _at_rail(graph, lane, certificate))
    yield Flag(_SATURATED, "output_saturated", _saturated(graph, lane))
    yield Flag(_SETTLING, "settling", settling)
    if len(input_flags) > 1:
        yield Flag(_OUTSIDE, "outside_calibration", input_flags[1])
    elif certificate.ideal.polynomial is None or (item is not None and not item.calibrated):
        yield Flag(_OUTSIDE, "", {})
    elif item is not None:
        yield Flag(_OUTSIDE, "outside_calibration", _outside(graph, lane, item.calibrated))
    if limits is not None:
        code = graph.seen(lane.output, "")
        for place, name, limit in zip(_WEAR, ("wear_warning", "wear_critical"), limits, strict=True):
            worn = plus(constant(1), graph.forms.negative(plus(code, limit, -1)), -1)
            yield Flag(place, name, plus(worn, graph.forms.times(worn, settling), -1))
    elif item is not None or _has_no_wear(certificate):
        yield from (Flag(place, "", {}) for place in _WEAR)
    yield from (Flag(place, "", {}) for place in _NONE)


def _has_no_wear(certificate: Certificate) -> bool:
    """Whether the words of the specification say that there is no wear."""
    return certificate.about is not None and "wear" not in words_of(certificate.about.specification)


def _outside(graph: GraphCodes, lane: LanePorts, calibrated: Sequence[tuple[int, int]]) -> Form:
    """Whether an input lies outside the calibration."""
    forms, inside = graph.forms, constant(1)
    for node, (low, high) in zip(lane.inputs, calibrated, strict=True):
        below = forms.negative(plus(graph.codes[node], constant(low), -1))
        above = forms.negative(plus(constant(high), graph.codes[node], -1))
        inside = forms.times(inside, forms.times(_not(below), _not(above)))
    return _not(inside)


def _not(bit: Form) -> Form:
    return plus(constant(1), bit, -1)


def _at_rail(graph: GraphCodes, lane: LanePorts, certificate: Certificate) -> Form:
    """Whether an input has its lowest or its highest code."""
    forms, inside = graph.forms, constant(1)
    for node, port in zip(lane.inputs, certificate.inputs, strict=True):
        code = graph.codes[node]
        above = forms.negative(plus(constant(port.lowest), code, -1))
        below = forms.negative(plus(code, constant(port.highest), -1))
        inside = forms.times(inside, forms.times(above, below))
    return plus(constant(1), inside, -1)


def _saturated(graph: GraphCodes, lane: LanePorts) -> Form:
    """Whether the output was limited to its range."""
    node = graph.nodes[lane.output]
    if node.entry.op is not Operation.CLAMP:
        return {}
    of = graph.seen(node.operands[0], node.stage)
    below = graph.forms.negative(plus(of, constant(node.entry.low), -1))
    above = graph.forms.negative(plus(constant(node.entry.high), of, -1))
    return plus(below, above)
