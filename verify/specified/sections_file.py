"""Reads the file that `filter.sos_file` or `filter.taps_file` names, by code of its own.

Sections are rows of six numbers, with MATLAB's scale values; taps are one row or one column.

Only files whose meaning is beyond doubt: ``.npy``, ``.mat`` with SOS, and text with six columns. The signs of a1 and a2
are scipy's, or both negated if only that is stable.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from io import BytesIO
from itertools import chain
from pathlib import Path
from typing import Any

from sosmith.verify.given_file import read_given
from sosmith.verify.graph import RejectedError
from sosmith.verify.specified.mat_matrices import doubles_in

_MAX_BYTES = 1 << 22
_MAX_EXPONENT = 400

_Rows = list[list[Fraction]]


def sections_in(path: Path) -> tuple[tuple[Fraction, ...], ...]:
    """Return the sections (b0, b1, b2, 1, a1, a2) in a file.

    Raises
    ------
    RejectedError
        If the file cannot be read, or is of a kind that this module does not read.
    """
    rows, scale = _read(path, "sos_file", "sections")
    if (
        not rows
        or any(len(row) != 6 or not row[3] for row in rows)
        or len(scale) not in (0, 1, len(rows), len(rows) + 1)
    ):
        raise RejectedError(
            "filter.sos_file must have rows of six numbers to be compared, not another format: "
            "`sosmith import` writes its sections into the specification"
        )
    for k, factor in enumerate(scale):
        row = rows[min(k, len(rows) - 1)]
        row[:3] = [b * factor for b in row[:3]]
    sections = [[value / row[3] for value in row] for row in rows]
    if not _stable(sections):
        sections = [[*row[:4], -row[4], -row[5]] for row in sections]
    return tuple(map(tuple, sections))


def taps_in(path: Path) -> tuple[Fraction, ...]:
    """Return the taps in a file: one row or one column of numbers.

    Raises
    ------
    RejectedError
        As `sections_in`.
    """
    rows, scale = _read(path, "taps_file", "taps")
    if scale or not rows or (len(rows) > 1 and any(len(row) != 1 for row in rows)):
        raise RejectedError(
            "filter.taps_file must have one row or one column of numbers to be compared, not another format: "
            "`sosmith import` writes its taps into the specification"
        )
    return tuple(value for row in rows for value in row)


def _read(path: Path, key: str, what: str) -> tuple[_Rows, list[Fraction]]:
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise RejectedError(f"filter.{key} must be at most {_MAX_BYTES} bytes, not longer")
        return _content(path.suffix.lower(), read_given(path, _MAX_BYTES))
    except RejectedError:
        raise
    except Exception as error:  # whatever a damaged file makes of its reader
        raise RejectedError(
            f"filter.{key} must be a file of {what} that can be read, not: {type(error).__name__}"
        ) from None


def _content(suffix: str, content: bytes) -> tuple[_Rows, list[Fraction]]:
    if suffix == ".npy":
        import numpy  # noqa: PLC0415 - slow to load, and seldom needed

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _rows(numpy.lib.format.read_array(BytesIO(content), allow_pickle=False)), []
    if suffix == ".mat":
        matrices = doubles_in(content, _MAX_BYTES)
        scale = matrices.get("g", matrices.get("scalevalues"))
        return matrices["sos"], list(chain.from_iterable(scale or []))
    text = content.decode("utf-8-sig")
    lines = [re.split("[#%]", line)[0].strip(" \t,;") for line in text.splitlines()]
    cells = [re.split(r"[\s,;]+", line) for line in lines if line]
    if cells and cells[0][0][:1].isalpha():  # names of the columns
        cells = cells[1:]
    return [[_number(cell) for cell in row] for row in cells], []


def _number(cell: str) -> Fraction:
    value = Decimal(cell)
    if not value.is_finite() or abs(value.adjusted()) > _MAX_EXPONENT:
        raise ValueError(cell)
    return Fraction(value)


def _rows(array: Any) -> _Rows:
    listed = array.tolist()
    return [[Fraction(value) for value in (row if isinstance(row, list) else [row])] for row in _nested(listed)]


def _nested(listed: Any) -> Sequence[Any]:
    return listed if isinstance(listed[0], list) else [listed]


def _stable(rows: _Rows) -> bool:
    return all(abs(a2) < 1 and abs(a1) < 1 + a2 for *_, a1, a2 in rows)
