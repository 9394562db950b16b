"""Values from Python as `tomllib` gives them: every float as the shortest decimal number that reads back the same."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import Decimal
from numbers import Integral, Real
from typing import Any


def exact(value: Any) -> Any:
    """Return nested values as `tomllib` gives them, with every float as the `Decimal` that prints the same."""
    if isinstance(value, Mapping):
        return {str(key): exact(item) for key, item in value.items()}
    if isinstance(value, str | bool | Decimal):
        return value
    if hasattr(value, "tolist"):  # a numpy array or number
        return exact(value.tolist())
    if isinstance(value, Integral):
        return int(value)
    if isinstance(value, Real):
        return Decimal(repr(float(value)))
    if isinstance(value, Sequence):
        return [exact(item) for item in value]
    return value
