"""Reads a file with a filter by its kind."""

from __future__ import annotations

from pathlib import Path

from sosmith.gen.specification.choices import MAX_GIVEN_TAPS
from sosmith.gen.specification.coefficients.arrays import read_array_file
from sosmith.gen.specification.coefficients.content import Content, TransferFunction
from sosmith.gen.specification.coefficients.prototype_file import read_prototype
from sosmith.gen.specification.coefficients.text import read_text_file
from sosmith.model.errors import SpecificationError

OTHER_KINDS = {
    ".wav": "a recording (WAV): a response cannot be read as an IIR filter",
    ".flac": "a recording (FLAC): a response cannot be read as an IIR filter",
    ".mp3": "a recording (MP3): a response cannot be read as an IIR filter",
    ".slx": "a Simulink model: export SOS and G to a MAT file",
    ".fda": "a session of MATLAB's filter designer: export its coefficients",
    ".m": "a MATLAB script: run it, and save SOS and G to a MAT file",
    ".py": "a Python script: run it, and save the sections with numpy.save",
    ".xlsx": "a spreadsheet: save it as CSV",
}
"""What files with other suffixes are, and what to do with them."""

_ARRAYS = (".npy", ".npz", ".mat", ".json")


def read_filter_file(path: Path) -> Content:
    """Read a file with a filter: arrays and prototypes by their suffix, everything else as text.

    Raises
    ------
    SpecificationError
        If the file cannot be read, holds no filter that can be recognized, or one of too many taps.
    """
    content = _content(path)
    taps = content.taps if isinstance(content, TransferFunction) else None
    if taps is not None and len(taps) > MAX_GIVEN_TAPS:
        raise SpecificationError(f"{path}: the filter must have at most {MAX_GIVEN_TAPS} taps, not {len(taps):,}")
    return content


def _content(path: Path) -> Content:
    suffix = path.suffix.lower()
    if suffix in OTHER_KINDS:
        raise SpecificationError(f"{path}: the filter must be a file of coefficients, not {OTHER_KINDS[suffix]}")
    if suffix in _ARRAYS:
        return read_array_file(path)
    return read_prototype(path) if suffix == ".toml" else read_text_file(path)
