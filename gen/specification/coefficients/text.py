"""Text files with filters: tables, exported text of MATLAB's filter designer, lists of biquads.

The formats, and what tells them apart:

- MATLAB's filter designer and ``fcfwrite``: a line ``SOS Matrix:`` and one ``Scale Values:``, or a line ``Numerator:``
  and the taps of an FIR filter, comments behind ``%``.
- Room EQ Wizard and miniDSP: ``biquad1,`` and then ``b0=``, ``b1=``, ``b2=``, ``a1=``, ``a2=``. Both write a1 and a2
  with the sign they have on the right-hand side of the recursion: negated.
- Tables with six columns b0, b1, b2, a0, a1, a2, as pyfda's ``.sos`` and ``numpy.savetxt`` write them; with five
  columns, without a0, as for CMSIS-DSP, whose a1 and a2 are negated.
- Tables with the numerator and the denominator of a transfer function, as two rows or as two columns: pyfda's CSV.
- One column, or one row of other lengths than 5 and 6: the taps of an FIR filter.

Every number is read as the decimal number that it is.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from decimal import Decimal, InvalidOperation
from fractions import Fraction
from pathlib import Path

from sosmith.gen.specification.coefficients.content import Content, Row, StatedSections, TransferFunction
from sosmith.model.errors import SpecificationError
from sosmith.model.foreign_files import read_text

MAX_BYTES = 1 << 20
"""Largest size of a text file in bytes."""

_MAX_EXPONENT = 400
_NEAR = Fraction(1, 10**9)
_ENTRY = re.compile(r"\s*([ab]\d)\s*=\s*([^\s,;]+)\s*[,;]?\s*", re.IGNORECASE)
_HEADER = re.compile(r"biquad\s*\d+\s*,?", re.IGNORECASE)
_KEYS = ("b0", "b1", "b2", "a1", "a2")

_DESIGNER = "exported text of MATLAB's filter designer"
_NUMERATOR = "numerator:"

_Numbers = tuple[Fraction, ...]


def read_text_file(path: Path) -> Content:
    """Read a text file with a filter.

    Raises
    ------
    SpecificationError
        If the file cannot be read or has none of these formats; with the line.
    """
    text = read_text(path, what="the filter", max_bytes=MAX_BYTES).removeprefix("\ufeff")
    lines = text.splitlines()
    if any(line.strip().lower().startswith("sos matrix") for line in lines):
        return _designer(path, lines)
    if any(_HEADER.fullmatch(line.strip()) for line in lines):
        return _biquads(path, lines)
    if any(line.strip().lower() == _NUMERATOR for line in lines):
        return _numerator(path, lines)
    slip = next((cure for start, cure in _OTHERS.items() if any(line.strip().startswith(start) for line in lines)), "")
    if slip:
        raise SpecificationError(f"{path}: the filter must be given by coefficients, not {slip}")
    return _table(path, lines)


_OTHERS = {
    "Filter Settings file": "as Room EQ Wizard's list of Fc, Gain and Q: export the filters as biquad coefficients",
    "Preamp:": "as Equalizer APO's list of Fc, Gain and Q: export the filters as biquad coefficients",
    "Filter 1: ON": "as a list of Fc, Gain and Q: export the filters as biquad coefficients",
}
"""Files of other tools by how a line begins, and what they are."""


def _numerator(path: Path, lines: Sequence[str]) -> TransferFunction:
    """Read an FIR filter that MATLAB's filter designer exports."""
    start = next((at for at, line in enumerate(lines) if line.strip().lower() == _NUMERATOR), len(lines)) + 1
    cells = [(at, line.split("%")[0].split()) for at, line in enumerate(lines[start:], start + 1)]
    taps = tuple(value for at, row in cells for value in _numbers(path, at, row))
    if not taps:
        raise SpecificationError(f"{path}: Numerator must have at least one number, not none")
    return TransferFunction(format=_DESIGNER, numerator=taps, denominator=(Fraction(1),))


def _designer(path: Path, lines: Sequence[str]) -> StatedSections:
    """Read what MATLAB's filter designer exports."""
    rows: list[_Numbers] = []
    gains: list[Fraction] = []
    part = ""
    for at, raw in enumerate(lines, 1):
        line = raw.split("%")[0].strip()
        if "coefficient format:" in raw.lower() and "decimal" not in raw.lower().split():
            raise _unfit(path, at, "the coefficient format Decimal", raw)
        heading = next((words for words in ("sos matrix", "scale values") if line.lower().startswith(words)), None)
        if heading is not None:
            part = heading
        elif line and part == "scale values":
            gains += _numbers(path, at, line.split())
        elif line and part:
            rows.append(_numbers(path, at, line.split()))
            if len(rows[-1]) != 6:
                raise _unfit(path, at, "a row of 6 numbers", line)
    if not rows:
        raise SpecificationError(f"{path}: SOS Matrix must have at least one row, not none")
    return StatedSections(format=_DESIGNER, rows=tuple(rows), gains=tuple(gains))


def _biquads(path: Path, lines: Sequence[str]) -> StatedSections:
    """Read a list of biquads in the format of Room EQ Wizard and miniDSP."""
    biquads: list[dict[str, Fraction]] = []
    for at, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip().startswith(("#", "%", "//")):
            continue
        if _HEADER.fullmatch(line.strip()):
            biquads.append({})
            continue
        entry = _ENTRY.fullmatch(line)
        if entry is None or not biquads or entry[1].lower() not in _KEYS:
            raise _unfit(path, at, "biquadN or one of b0, b1, b2, a1, a2 with its value", line)
        if entry[1].lower() in biquads[-1]:
            raise SpecificationError(f"{path}: line {at} must not give {entry[1]} a second time")
        (biquads[-1][entry[1].lower()],) = _numbers(path, at, [entry[2]])
    for index, biquad in enumerate(biquads, 1):
        for key in _KEYS:
            if key not in biquad:
                raise SpecificationError(f"{path}: biquad {index} must have {key}, not leave it out")
    rows = [tuple(biquad[key] for key in _KEYS) for biquad in biquads]
    return StatedSections(
        format="a list of biquads as from Room EQ Wizard and miniDSP", rows=_with_a0(rows), signs="negated"
    )


def _table(path: Path, lines: Sequence[str]) -> Content:
    rows: list[_Numbers] = []
    headed = False
    for at, cells in _cells(lines):
        if not rows and not headed and not any(map(_is_number, cells)):
            headed = True
            continue
        rows.append(_numbers(path, at, cells))
        if len(rows[-1]) != len(rows[0]):
            numbers = "1 number" if len(rows[0]) == 1 else f"{len(rows[0])} numbers"
            raise _unfit(path, at, f"{numbers} as in the first row", " ".join(cells))
    if not rows:
        raise SpecificationError(f"{path}: the filter must have numbers, not none")
    return of_rows(path, rows, kind="a table")


def of_rows(path: Path, rows: Sequence[_Numbers], *, kind: str) -> Content:
    """Tell what a matrix of numbers is: sections with or without a0, or a transfer function.

    Raises
    ------
    SpecificationError
        If the shape fits none.
    """
    width = len(rows[0])
    if len(rows) == 2 and width > 1 and rows[1][0] == 1 and not (width in (5, 6) and _are_sections(*rows)):
        return TransferFunction(format=f"{kind} of b and a", numerator=rows[0], denominator=rows[1])
    if width == 6:
        return StatedSections(format=f"{kind} of b0, b1, b2, a0, a1, a2", rows=tuple(rows))
    if width == 5:
        return StatedSections(format=f"{kind} of b0, b1, b2, a1, a2", rows=_with_a0(rows), signs="negated")
    if width == 2 and len(rows) > 1 and rows[0][1] == 1:
        b, a = (tuple(row[k] for row in rows) for k in (0, 1))
        return TransferFunction(format=f"{kind} of b and a", numerator=b, denominator=a)
    if width == 1 or len(rows) == 1:
        taps = tuple(value for row in rows for value in row)
        return TransferFunction(format=f"{kind} of taps", numerator=taps, denominator=(Fraction(1),))
    raise SpecificationError(
        f"{path}: the filter must be rows of b0, b1, b2, a0, a1, a2, the same without a0, b and a with a0 = 1, or one "
        f"row or column of taps, not {len(rows)} x {width} numbers"
    )


def _are_sections(first: _Numbers, second: _Numbers) -> bool:
    """Tell two sections, the second with b0 = 1 as scipy scales it, from b and a of the fourth or fifth order.

    The zeros of most sections are on the unit circle or at 0: b2 is 1, -1 or 0, which a coefficient of `a` is not by
    chance. As a denominator, the numbers of other sections are unstable as a rule.
    """
    near = min(abs(abs(second[2]) - size) for size in (0, 1)) < _NEAR
    beside_one = len(second) == 6 and first[3] == second[3] == 1
    return beside_one or (len(second) == 5 and near) or not _is_stable(second)


def _is_stable(polynomial: _Numbers) -> bool:
    """Whether all roots of a polynomial in 1/z are inside the unit circle, by the recursion of Schur and Cohn."""
    while len(polynomial) > 1:
        ratio = polynomial[-1] / polynomial[0]
        if abs(ratio) >= 1:
            return False
        polynomial = tuple(a - ratio * b for a, b in zip(polynomial, polynomial[::-1], strict=True))[:-1]
    return True


def _with_a0(rows: Sequence[_Numbers]) -> tuple[Row, ...]:
    return tuple((*row[:3], Fraction(1), *row[3:]) for row in rows)


def _cells(lines: Sequence[str]) -> Iterator[tuple[int, list[str]]]:
    """Yield the number and the cells of every line that has any; comments begin with # or %."""
    plain = [re.split("[#%]", line, maxsplit=1)[0].strip() for line in lines]
    separator = next((mark for mark in ";\t," if any(mark in line for line in plain)), None)
    for at, text in enumerate(plain, 1):
        line = text.strip(separator or " ")
        if line:
            yield at, [cell.strip() for cell in line.split(separator)]


def _is_number(cell: str) -> bool:
    try:
        Decimal(cell)
    except InvalidOperation:
        return False
    return True


def _numbers(path: Path, at: int, cells: Sequence[str]) -> _Numbers:
    return tuple(_number(path, at, cell) for cell in cells)


def _number(path: Path, at: int, cell: str) -> Fraction:
    try:
        value = Decimal(cell)
    except InvalidOperation:
        raise _unfit(path, at, "numbers with a decimal point", cell) from None
    if not value.is_finite() or (value and abs(value.adjusted()) > _MAX_EXPONENT) or len(cell) > _MAX_EXPONENT:
        raise _unfit(path, at, "finite numbers within reason", cell)
    return Fraction(value)


def _unfit(path: Path, at: int, expected: str, line: str) -> SpecificationError:
    shown = line.strip()[:60]
    return SpecificationError(f"{path}: line {at} must have {expected}, not {shown!r}")
