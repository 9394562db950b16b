"""Specifications in memory for the tests."""

from functools import cache
from pathlib import Path
from typing import Any

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.specification import load

EXAMPLES = Path(__file__).parents[2] / "examples"
ALL = sorted(path.name for path in EXAMPLES.glob("*.toml"))


@cache
def example_design(name: str, **options: Any) -> CoreDesign:
    """Design the core of an example specification."""
    return design_core(load(EXAMPLES / name), **options)
