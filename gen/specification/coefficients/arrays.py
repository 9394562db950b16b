"""Files of arrays with filters: NumPy's ``.npy`` and ``.npz``, MATLAB's ``.mat``, and pyfda's ``.json``.

Doubles are taken as the numbers that they are.
"""

from __future__ import annotations

import json
import math
import struct
import warnings
import zlib
from collections.abc import Mapping
from decimal import Decimal
from fractions import Fraction
from io import BytesIO
from pathlib import Path
from typing import IO, Any

import numpy as np

from sosmith.gen.specification.coefficients.content import (
    Complex,
    Content,
    StatedSections,
    TransferFunction,
    ZerosAndPoles,
)
from sosmith.gen.specification.coefficients.mat_file import matrices
from sosmith.gen.specification.coefficients.text import of_rows
from sosmith.model.errors import SpecificationError
from sosmith.model.foreign_files import opened, read_text

MAX_BYTES = 1 << 22
"""Largest size of a file in bytes."""

_MAX_NUMBERS = 4096
_MAX_ITEM = 32  # bytes of a number: the widest complex ones
_WAYS = ("sos", "zpk", "ba")
"""Names of arrays, the exact one first: pyfda keeps a filter in all three."""


def read_array_file(path: Path) -> Content:
    """Read a ``.npy``, ``.npz``, ``.mat`` or ``.json`` file with a filter.

    Raises
    ------
    SpecificationError
        If the file cannot be read, is too large, or holds no filter that can be recognized.
    """
    suffix = path.suffix.lower()
    if suffix == ".json":
        return _json(path)
    try:
        if path.stat().st_size > MAX_BYTES:
            raise SpecificationError(f"{path}: the filter must be at most {MAX_BYTES} bytes, not longer")
        if suffix == ".mat":
            return _matlab(path)
        return _numpy(path, suffix)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise SpecificationError(f"{path}: the filter must be a readable file, not: {reason}") from None


def _numpy(path: Path, suffix: str) -> Content:
    what = f"a NumPy file {suffix}"
    try:
        # Objects could run code when they are read; a filter needs none.
        with opened(path) as file, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about headers of Python 2
            if suffix == ".npy":
                return of_rows(path, _matrix(path, _array(path, file)), kind=what)
            loaded = np.load(file, allow_pickle=False)
            name = next((name for name in _WAYS if name in loaded.files), None)
            if name is None:
                raise SpecificationError(f"{path}: arrays must have one named {', '.join(_WAYS)}, not {loaded.files}")
            if sum(part.file_size for part in loaded.zip.infolist()) > MAX_BYTES:
                raise SpecificationError(f"{path}: arrays must be at most {MAX_BYTES} bytes unpacked, not longer")
            with loaded.zip.open(name if name in loaded.zip.namelist() else f"{name}.npy") as part:
                content = part.read(MAX_BYTES)
            if not content.startswith(np.lib.format.MAGIC_PREFIX):
                raise SpecificationError(f"{path}: {name} must be an array, not other bytes")
            array = _array(path, BytesIO(content))
    except (ValueError, EOFError, KeyError, TypeError, SyntaxError, NotImplementedError, MemoryError) as error:
        raise SpecificationError(f"{path}: the filter must be {what} of numbers, not: {_first_line(error)}") from None
    except Exception as error:  # zipfile and zlib have errors of their own for damaged archives
        if isinstance(error, OSError | SpecificationError):
            raise
        raise SpecificationError(f"{path}: the filter must be {what}, not a damaged one") from None
    if name == "zpk":
        return _zpk(path, array)
    return of_rows(path, _matrix(path, array), kind=f"{name} in {what}")


def _array(path: Path, file: IO[bytes]) -> np.ndarray[Any, Any]:
    """Read an array, once its header says that it is small: NumPy takes room for all of it before it is read."""
    content = BytesIO(file.read(MAX_BYTES))
    version = np.lib.format.read_magic(content)
    header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, kind = header(content)
    if math.prod(shape) > _MAX_NUMBERS or kind.itemsize > _MAX_ITEM:
        raise _unfit(path, shape, kind)
    content.seek(0)
    array: np.ndarray[Any, Any] = np.lib.format.read_array(content, allow_pickle=False)
    return array


def _unfit(path: Path, shape: tuple[int, ...], kind: np.dtype[Any]) -> SpecificationError:
    return SpecificationError(
        f"{path}: the filter must be a matrix of 1 to {_MAX_NUMBERS} real numbers, "
        f"not {' x '.join(map(str, shape)) or 'one'} of type {str(kind)[:60]}"
    )


def _matlab(path: Path) -> Content:
    with opened(path) as file:
        content = file.read(MAX_BYTES)
    try:
        variables = matrices(content, MAX_BYTES)
    except NotImplementedError:
        raise SpecificationError(
            f"{path}: the filter must be a MAT file up to version 7, not 7.3: save with -v7"
        ) from None
    except (ValueError, KeyError, IndexError, StopIteration, struct.error, zlib.error):
        raise SpecificationError(f"{path}: the filter must be a MAT file, not a damaged one or another kind") from None
    names = {name.lower(): name for name in variables}
    if "sos" in names:
        matrix = _matrix(path, variables[names["sos"]])
        scale = next((names[name] for name in ("g", "scalevalues") if name in names), None)
        gains = () if scale is None else tuple(value for row in _matrix(path, variables[scale]) for value in row)
        if any(len(row) != 6 for row in matrix):
            raise SpecificationError(f"{path}: {names['sos']} must have 6 columns, not {len(matrix[0])}")
        stated = f"MATLAB's {names['sos']}" + ("" if scale is None else f" and {scale}")
        return StatedSections(format=stated, rows=tuple(matrix), gains=gains)
    if {"z", "p", "k"} <= names.keys():
        return _zeros_poles_gain(path, *(variables[names[name]] for name in ("z", "p", "k")))
    if {"b", "a"} <= names.keys():
        return _numerator_and_denominator(path, variables[names["b"]], variables[names["a"]])
    if "ba" in names:
        return of_rows(path, _matrix(path, variables[names["ba"]]), kind=f"{names['ba']} in a MAT file")
    taps = next((names[name] for name in _TAPS if name in names), None)
    if taps is not None:
        return _numerator_and_denominator(path, variables[taps], np.ones((1, 1)), f"{taps} in a MAT file")
    raise SpecificationError(
        f"{path}: variables must be SOS, with or without G, b and a, z, p and k, or Num, h or b alone, not only "
        f"{', '.join(variables) or 'none'}"
    )


_TAPS = ("num", "h", "b")
"""Names of the taps of an FIR filter, without regard to case; the filter designer has the first."""


def _numerator_and_denominator(
    path: Path, b: np.ndarray[Any, Any], a: np.ndarray[Any, Any], what: str = "b and a in a MAT file"
) -> TransferFunction:
    """Read a transfer function; the coefficients are divided by a0."""
    upper, lower = ([value for row in _matrix(path, array) for value in row] for array in (b, a))
    if not lower[0]:
        raise SpecificationError(f"{path}: a must begin with a number other than 0, not 0")
    longest = max(len(upper), len(lower))
    rows = [[value / lower[0] for value in side] + [Fraction(0)] * (longest - len(side)) for side in (upper, lower)]
    return TransferFunction(format=what, numerator=tuple(rows[0]), denominator=tuple(rows[1]))


def _zeros_poles_gain(path: Path, *arrays: np.ndarray[Any, Any]) -> ZerosAndPoles:
    for name, array in zip("zpk", arrays, strict=True):
        if array.dtype.kind not in "cfiu" or array.size > _MAX_NUMBERS or not np.isfinite(array.astype(complex)).all():
            raise SpecificationError(f"{path}: {name} must be finite numbers, not of type {array.dtype}")
    z, p, k = (array.astype(complex).ravel().tolist() for array in arrays)
    if len(k) != 1 or k[0].imag:
        raise SpecificationError(f"{path}: k must be one real number, not {len(k)}")
    return ZerosAndPoles(
        format="z, p and k in a MAT file",
        zeros=tuple(map(exact_complex, z)),
        poles=tuple(map(exact_complex, p)),
        gain=Fraction(k[0].real),
    )


def _json(path: Path) -> Content:
    text = read_text(path, what="the filter", max_bytes=MAX_BYTES)
    try:
        tree = json.loads(text, parse_float=Decimal)
    except (ValueError, RecursionError, ArithmeticError):
        raise SpecificationError(f"{path}: the filter must be JSON, not something else") from None
    rows = tree.get("sos") if isinstance(tree, Mapping) else None
    if not isinstance(rows, list) or not rows:
        raise SpecificationError(f"{path}: the filter must have sections in sos, as pyfda saves them, not none")
    exact = [_row(path, row) for row in rows]
    if any(len(row) != 6 for row in exact):
        raise SpecificationError(f"{path}: sos must have rows of 6 numbers, not {len(exact[0])}")
    return StatedSections(format="sos in a JSON file", rows=tuple(exact))


def _row(path: Path, row: Any) -> tuple[Fraction, ...]:
    if not isinstance(row, list) or any(isinstance(v, bool) or not isinstance(v, int | Decimal) for v in row):
        raise SpecificationError(f"{path}: sos must have rows of numbers, not {str(row)[:60]!r}")
    if any(isinstance(v, Decimal) and (not v.is_finite() or abs(v.adjusted()) > 400) for v in row):
        raise SpecificationError(f"{path}: sos must have finite numbers within reason, not {str(row)[:60]!r}")
    return tuple(Fraction(value) for value in row)


def _matrix(path: Path, array: np.ndarray[Any, Any]) -> list[tuple[Fraction, ...]]:
    """Return a matrix of finite real numbers exactly, one row for a vector."""
    if array.dtype.kind not in "fiu" or not 1 <= array.ndim <= 2 or not 0 < array.size <= _MAX_NUMBERS:
        raise _unfit(path, array.shape, array.dtype)
    rows = np.atleast_2d(array)
    if array.dtype.kind == "f" and not np.isfinite(rows).all():
        raise SpecificationError(f"{path}: the filter must have finite numbers, not nan or infinite ones")
    return [tuple(Fraction(value) for value in row) for row in rows.tolist()]


def _zpk(path: Path, array: np.ndarray[Any, Any]) -> ZerosAndPoles:
    """Read pyfda's zeros, poles and gains as three rows."""
    if array.dtype.kind not in "cfiu" or array.ndim != 2 or array.shape[0] != 3 or not 0 < array.size <= _MAX_NUMBERS:
        raise SpecificationError(f"{path}: zpk must be three rows of zeros, poles and gain, not of shape {array.shape}")
    values = array.astype(complex)
    if not np.isfinite(values).all():
        raise SpecificationError(f"{path}: zpk must have finite numbers, not nan or infinite ones")
    gain = math.fsum(values[2].real.tolist())
    return ZerosAndPoles(
        format="zpk in a NumPy file .npz",
        zeros=tuple(map(exact_complex, values[0].tolist())),
        poles=tuple(map(exact_complex, values[1].tolist())),
        gain=Fraction(gain),
    )


def exact_complex(value: complex) -> Complex:
    """Real and imaginary part as the rationals that they are."""
    return Fraction(value.real), Fraction(value.imag)


def _first_line(error: Exception) -> str:
    lines = str(error).split("\n")
    return " ".join(lines[0][:100].split()) or type(error).__name__
