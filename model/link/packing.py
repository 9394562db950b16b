"""Samples and results as bytes: every code extended to whole bytes, the lowest byte first, as on an AXI4-Stream."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sosmith.model.arrays import Codes
from sosmith.model.port import Port


def bytes_of(codes: Codes, sizes: Sequence[int]) -> bytes:
    """Return the bytes of `codes`, shape (n, fields), each field of as many bytes as `sizes` says."""
    columns = [codes[:, k] >> 8 * n & 0xFF for k, size in enumerate(sizes) for n in range(size)]
    return np.stack(columns, axis=1).astype(np.uint8).tobytes()


def codes_of(data: bytes, ports: Sequence[Port]) -> Codes:
    """Return the codes in `data`, shape (n, ports).

    Bits beyond those of a code are ignored, as the hardware does with samples; `bytes_of` the codes tells whether they
    are those of the sign, as they are in results.
    """
    rows = np.frombuffer(data, np.uint8).reshape(-1, sum(port.bytes for port in ports)).astype(np.int64)
    codes = np.zeros((len(rows), len(ports)), dtype=np.int64)
    start = 0
    for k, port in enumerate(ports):
        for n in range(port.bytes):
            codes[:, k] |= rows[:, start + n] << 8 * n
        codes[:, k] &= (1 << port.bits) - 1
        codes[codes[:, k] > port.highest, k] -= 1 << port.bits
        start += port.bytes
    return codes
