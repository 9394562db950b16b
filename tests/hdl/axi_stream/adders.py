"""A small core with flags."""

from fractions import Fraction

from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import GraphBuilder
from sosmith.model.port import Port
from sosmith.model.sections.horner import HornerStep
from sosmith.model.sections.output import OutputStage

Ends = tuple[int, int]


A, B = (0, 31), (-8, 7)
"""Lowest and highest code of the inputs: five bits without a sign, and four with one."""


def port(name: str, bits: int, *, signed: bool) -> Port:
    return Port(name=name, bits=bits, signed=signed, lsb=Fraction(1), zero=Fraction(0))


def adder(calibrated: tuple[Ends, Ends], wear: tuple[Ends, ...], *, signed: bool = False) -> Datapath:
    """Make ``y = a + b``, limited to five bits."""
    g = GraphBuilder()
    graph = g.build([g.add(g.input("a", 0, *A), g.input("b", 0, *B))])
    (total,) = graph.output_ranges
    y = port("y", 5, signed=signed)
    last = OutputStage(offset=0, offset_frac=0, x=total, low=y.lowest, high=y.highest)
    inputs = (port("a", 5, signed=False), port("b", 4, signed=True))
    stages = (HornerStep("sum", graph), last)
    return Datapath(name="adder", inputs=inputs, output=y, stages=stages, calibrated=calibrated, wear=wear)
