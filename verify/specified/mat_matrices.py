"""Reads the sections in a MAT file of version 5 to 7, little-endian, as MATLAB and scipy write it."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from fractions import Fraction

from sosmith.verify.graph import require

_DOUBLES = 0x0006
"""Flags and class of a matrix that is real, not logical, full and of doubles."""

_WANTED = ("sos", "g", "scalevalues")
_FORMATS = {1: "b", 2: "B", 3: "h", 4: "H", 5: "i", 6: "I", 9: "d"}
"""How numbers may be stored: doubles without a fraction as integers."""


def doubles_in(content: bytes, largest: int) -> dict[str, list[list[Fraction]]]:
    """Return the matrices sos, g and scalevalues by their names in lower case, row by row.

    Raises
    ------
    RejectedError
        If one of them occurs twice or has other numbers, or the file is another one.
    ValueError, KeyError, struct.error, zlib.error
        If it is damaged, or a variable has more than `largest` bytes.
    """
    require(content[124:128] == b"\x00\x01IM", "filter.sos_file must be a MAT file up to version 7, not another one")
    matrices: dict[str, list[list[Fraction]]] = {}
    for part in _parts(content, 128):
        kind, data = part
        if kind == 15:
            ((kind, data),) = _parts(zlib.decompressobj().decompress(data, largest), 0)
        if kind != 14:
            raise ValueError(kind)
        (_, flags), (_, sizes), (_, name), *numbers = _parts(data, 0)
        plain = name.decode("ascii").lower()
        require(plain not in matrices, f"filter.sos_file must have {plain} once, not twice")
        is_real = struct.unpack_from("<H", flags)[0] == _DOUBLES
        require(is_real or plain not in _WANTED, f"filter.sos_file must have real doubles in {plain}, not others")
        if plain in _WANTED:
            matrices[plain] = _matrix(sizes, *numbers[0])
    return matrices


def _parts(data: bytes, at: int) -> Iterator[tuple[int, bytes]]:
    while at < len(data):
        kind, size = struct.unpack_from("<HH", data, at)
        start = at + 4
        if not size:
            (size,) = struct.unpack_from("<I", data, start)
            start += 4
        if start + size > len(data):
            raise ValueError(size)
        yield kind, data[start : start + size]
        at = start + size if kind == 15 else at + 8 if start == at + 4 else start + (size + 7) // 8 * 8


def _matrix(sizes: bytes, kind: int, numbers: bytes) -> list[list[Fraction]]:
    rows, columns = struct.unpack("<2i", sizes)
    code = _FORMATS[kind]
    values = struct.unpack(f"<{rows * columns}{code}", numbers)
    return [[Fraction(value) for value in values[row::rows]] for row in range(rows)]
