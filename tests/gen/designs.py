"""Specifications in memory for the tests."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.filter.design import Filter
from sosmith.gen.filter.exact_form import rounded_rows
from sosmith.gen.specification.specification import load

EXAMPLES = Path(__file__).parents[2] / "examples"
ALL = sorted(path.name for path in EXAMPLES.glob("*.toml"))


@cache
def example_design(name: str, **options: Any) -> CoreDesign:
    """Design the core of an example specification."""
    return design_core(load(EXAMPLES / name), **options)


@cache
def zero_design(name: str, **options: Any) -> CoreDesign:
    """Design the same with a filter that starts from zero."""
    spec = load(EXAMPLES / name)
    return design_core(replace(spec, hardware=replace(spec.hardware, start="zero")), **options)


@cache
def parallel_design(name: str, **options: Any) -> CoreDesign:
    """Design the same in the parallel architecture, which simulates the most samples a second."""
    spec = load(EXAMPLES / name)
    return design_core(replace(spec, hardware=replace(spec.hardware, architecture="parallel")), **options)


def with_rows(filter_: Filter, rows: Iterable[Sequence[float]]) -> Filter:
    """Return a filter with other sections, which are exact as they are."""
    made = tuple(tuple(map(float, row)) for row in rows)
    return replace(filter_, rows=made, exact=rounded_rows([list(map(Fraction, row)) for row in made], 1100))
