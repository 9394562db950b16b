"""Designs that start from their first sample."""

from dataclasses import replace
from fractions import Fraction
from functools import cache

from tests.gen.designs import EXAMPLES

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.filter.design import Filter, design
from sosmith.gen.specification.specification import FilterSpec, load
from sosmith.model.port import Port

CURRENT = Port.from_range("i", 12, Fraction(4), Fraction(20))
"""A range that does not contain 0."""


@cache
def steady_design(name: str, **hardware: object) -> CoreDesign:
    spec = load(EXAMPLES / name)
    return design_core(replace(spec, hardware=replace(spec.hardware, start="steady", **hardware)))


def ripple() -> Filter:
    """Design a filter of even order, whose gain at zero frequency is not 1."""
    given = FilterSpec(
        family="chebyshev1",
        kind="lowpass",
        method="bilinear",
        order=4,
        cutoff=(Fraction(1, 20),),
        passband_edge=None,
        stopband_edge=None,
        passband_loss=Fraction(1),
        stopband_loss=None,
        sos=None,
    )
    return design(given, 1.0)
