"""Decimators to simulate."""

from fractions import Fraction

from sosmith.model.dataflow.decimator import Decimator
from sosmith.model.port import Port


def decimator(factor: int, stages: int, dropped: int, *, signed: bool = True, steady: bool = True) -> Decimator:
    port = Port(name="x", bits=6, signed=signed, lsb=Fraction(1), zero=Fraction(0))
    return Decimator(input=port, factor=factor, stages=stages, dropped=dropped, steady=steady)
