"""Reads a file with a filter by its kind."""

from __future__ import annotations

from pathlib import Path

from sosmith.gen.specification.coefficients.arrays import read_array_file
from sosmith.gen.specification.coefficients.content import Content
from sosmith.gen.specification.coefficients.prototype_file import read_prototype
from sosmith.gen.specification.coefficients.text import read_text_file

_ARRAYS = (".npy", ".npz", ".mat", ".json")


def read_filter_file(path: Path) -> Content:
    """Read a file with a filter: arrays and prototypes by their suffix, everything else as text.

    Raises
    ------
    SpecificationError
        If the file cannot be read or holds no filter that can be told.
    """
    suffix = path.suffix.lower()
    if suffix in _ARRAYS:
        return read_array_file(path)
    return read_prototype(path) if suffix == ".toml" else read_text_file(path)
