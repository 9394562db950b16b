"""Where the codes of a sample lie in the input of a core, and what is beside them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from sosmith.verify.certificate_file import Certificate
from sosmith.verify.graph import require
from sosmith.verify.parallel.graph_codes import GraphCodes
from sosmith.verify.program.normal_form import Form

DATA = "s_axis_tdata"


class Field(NamedTuple):
    """Bits of the input: their place, and what they hold as an unsigned word."""

    offset: int
    width: int
    word: Form


def fields_of(graph: GraphCodes, certificate: Certificate, width: int, input_flags: Sequence[Form]) -> list[Field]:
    """Return the fields of the input and what is beside them; each begins a byte. Above them are flags of inputs.

    Raises
    ------
    RejectedError
        If they do not fill the input, which has `width` bits.
    """
    fields: list[Field] = []
    offset = 0
    for lane in graph.lanes:
        for node, port in zip(lane.inputs, certificate.inputs, strict=True):
            fields.append(Field(offset, port.bits, graph.forms.unsigned(graph.codes[node], port.bits)))
            offset += port.bits
            beside = -offset % 8
            if beside:
                padding = graph.forms.variable(("padding", node), 0, (1 << beside) - 1)
                fields.append(Field(offset, beside, padding))
            offset += beside
    for flag in input_flags:
        fields.append(Field(offset, 1, flag))
        offset += 1
    require(width == offset, f"the port {DATA} must have {offset} bits, not {width}")
    return fields
