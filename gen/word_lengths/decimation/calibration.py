"""The calibration before a decimator: a datapath of its own, whose output is as wide as its result can be.

The polynomial is not linear, so that it has to take every sample. Its result is not limited before the decimator, as
the exact one is limited at the end only: the port between them holds all that the polynomial can give, in steps of a
power of two of the output's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

from sosmith.gen.realizations.registry import REALIZATIONS
from sosmith.gen.word_lengths.quantize import plan, prove
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port

_WIDEST = 32
"""Bits of the widest port."""


def calibration_before_decimator(
    name: str, inputs: Sequence[Port], polynomial: Polynomial, output: Port, allowed: Fraction
) -> Quantized:
    """Choose formats of a calibration before a decimator, and prove its error.

    Parameters
    ----------
    name : str
        Name of its core.
    inputs : sequence of Port
        What it takes.
    polynomial : Polynomial
        The calibration in physical units.
    output : Port
        What leaves the filter behind the decimator: it gives the unit, and its LSB the steps.
    allowed : Fraction
        Error allowed, in LSBs of `output`; half of it at most is the rounding to the port.

    Raises
    ------
    ShortfallError
        If no formats keep to the error allowed, or the result needs more bits than a port has.
    """
    frac = 0
    while allowed * 2**frac < 1:
        frac += 1
    port = Port(
        name=output.name, bits=_WIDEST, signed=True, lsb=output.lsb / 2**frac, zero=Fraction(0), unit=output.unit
    )
    planned = plan(
        name=name,
        inputs=tuple(inputs),
        output=port,
        max_error=allowed * output.lsb,
        ideal=None,
        polynomial=polynomial,
        realization=next(iter(REALIZATIONS)),
    )
    widest = prove(planned)
    graph = widest.datapath.stages[-1].graph
    # Where the port is too narrow, the stage limits its result to it.
    (result,) = (graph.nodes[i] for i in graph.outputs)
    unlimited = graph.nodes[result.operands[0]] if (result.low, result.high) == (port.lowest, port.highest) else result
    signed = unlimited.low < 0
    bits = max(2, signed + max(unlimited.high, -unlimited.low - 1).bit_length())
    if bits > _WIDEST:
        raise ShortfallError(
            f"what the calibration gives to the decimator must have at most {_WIDEST} bits, not {bits}: raise "
            "output.max_error or narrow the ranges of the inputs"
        )
    fitting = replace(port, bits=bits, signed=signed)
    return prove(replace(planned, output=fitting))
