"""Reads the matrices of a MAT file, versions 4 to 7: elements of a tag with type and size, and data.

scipy's reader trusts the types and sizes in a file, and a damaged one ends the process. This one knows numbers only.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np

_Array = np.ndarray[Any, Any]

_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_INT8, _INT32, _UINT32, _MATRIX, _COMPRESSED = 1, 5, 6, 14, 15
_NUMERIC_CLASSES = range(6, 16)
_COMPLEX, _LOGICAL = 0x0800, 0x0200
_TYPES_OF_VERSION_4 = ("f8", "f4", "i4", "i2", "u2", "u1")
_HEADER = 128
_OTHER: _Array = np.empty((), dtype=object)


def matrices(content: bytes, max_bytes: int) -> dict[str, _Array]:
    """Return the variables of a MAT file; those that are no matrices of numbers as an object without a shape.

    Parameters
    ----------
    content : bytes
        The file.
    max_bytes : int
        Largest size of all compressed variables together.

    Raises
    ------
    ValueError, struct.error, zlib.error
        If the content is damaged, or unpacks to more.
    NotImplementedError
        If it is of version 7.3.
    """
    order = {b"IM": "<", b"MI": ">"}.get(content[126:128])
    if order is None:
        return dict(_version_4(content))
    (version,) = struct.unpack_from(f"{order}H", content, 124)
    if version == 0x0200:
        raise NotImplementedError
    arrays = {}
    left = max_bytes
    for element in _elements(content[_HEADER:], order):
        kind, data = element
        if kind == _COMPRESSED:
            unpacked = zlib.decompressobj().decompress(data, left + 1)
            left -= len(unpacked)
            if left < 0:
                raise ValueError(left)
            kind, data = next(_elements(unpacked, order))
        if kind != _MATRIX:
            raise ValueError(kind)
        name, array = _variable(data, order)
        arrays[name] = array
    return arrays


def _elements(data: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Yield the type and the data of each element; one of up to 4 bytes can be within its tag."""
    at = 0
    while at < len(data):
        (kind,) = struct.unpack_from(f"{order}I", data, at)
        size, start = kind >> 16, at + 4
        if not size:
            (size,) = struct.unpack_from(f"{order}I", data, start)
            start = at + 8
        part = data[start : start + size]
        if len(part) < size or (start == at + 4 and size > 4):
            raise ValueError(size)
        yield kind & 0xFFFF, part
        at = start + (size if kind == _COMPRESSED else max(4, size) if start == at + 4 else -(-size // 8) * 8)


def _variable(data: bytes, order: str) -> tuple[str, _Array]:
    parts = _elements(data, order)
    flags, sizes, name = (
        np.frombuffer(_expected(next(parts, None), kind), order + _TYPES[kind]) for kind in (_UINT32, _INT32, _INT8)
    )
    plain = name.tobytes().decode("ascii")
    if int(flags[0]) & 0xFF not in _NUMERIC_CLASSES or int(flags[0]) & _LOGICAL:
        return plain, _OTHER
    values = [np.frombuffer(numbers, order + _TYPES[kind]) for kind, numbers in parts]
    real, *imaginary = values[:2] if int(flags[0]) & _COMPLEX else values[:1]
    whole = real + 1j * imaginary[0] if imaginary else real
    return plain, whole.reshape(sizes.tolist(), order="F")


def _expected(element: tuple[int, bytes] | None, kind: int) -> bytes:
    if element is None or element[0] != kind or not element[1]:
        raise ValueError(kind)
    return element[1]


def _version_4(content: bytes) -> Iterator[tuple[str, _Array]]:
    """Yield variables, each with a header of five numbers: type, rows, columns, whether complex, length of the name."""
    at = 0
    while at < len(content):
        kind, rows, columns, is_complex, length = struct.unpack_from("<5i", content, at)
        if not 0 <= kind < 60 or kind % 10 or min(rows, columns) < 0 or not 0 < length < _HEADER:
            raise ValueError(kind)
        dtype = np.dtype("<" + _TYPES_OF_VERSION_4[kind // 10])
        name = content[at + 20 : at + 20 + length].rstrip(b"\0").decode("ascii")
        at += 20 + length
        size = rows * columns * dtype.itemsize
        array = np.frombuffer(content[at : at + size], dtype).reshape((rows, columns), order="F")
        yield name, _OTHER if is_complex else array
        at += size << bool(is_complex)
