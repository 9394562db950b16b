"""Specifications in memory for the tests."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.specification.specification import load

EXAMPLES = Path(__file__).parents[2] / "examples"
ALL = sorted(path.name for path in EXAMPLES.glob("*.toml"))


@cache
def example_design(name: str, **options: Any) -> CoreDesign:
    """Design the core of an example specification."""
    return design_core(load(EXAMPLES / name), **options)


@cache
def parallel_design(name: str, **options: Any) -> CoreDesign:
    """Design the same in the parallel architecture, which simulates the most samples a second."""
    spec = load(EXAMPLES / name)
    return design_core(replace(spec, hardware=replace(spec.hardware, architecture="parallel")), **options)
