"""Samples and results as bytes: every code extended to whole bytes, as on an AXI4-Stream, or results bit after bit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sosmith.model.arrays import Codes
from sosmith.model.link.protocol import MAX_BODY
from sosmith.model.port import Port

_BYTE = 8


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


@dataclass(frozen=True)
class Packing:
    """The form of packed results: the bits of the code, the lowest first, then one for each of some flags.

    Results follow one another without a gap, the first one from the lowest bit of the first byte on. Zero bits fill the
    last byte, and results that would have fewer than 8 bits, so that the number of bytes tells that of results.

    Attributes
    ----------
    port : Port
        The code.
    flags : tuple of int
        Bits of the status that are sent, in increasing order; the others are 0.
    """

    port: Port
    flags: tuple[int, ...]

    @property
    def bits(self) -> int:
        """Bits of a result."""
        return max(self.port.bits + len(self.flags), _BYTE)

    def per_message(self, sample_bytes: int = 1) -> int:
        """Return how many results fit a response behind a channel, and their samples a request."""
        return min((MAX_BODY - 2) * _BYTE // self.bits, (MAX_BODY - 1) // sample_bytes)

    def packed(self, results: bytes) -> bytes:
        """Pack results, each with its status behind it, as they are in ``SAMPLES`` and ``POLL``."""
        rows = np.frombuffer(results, np.uint8).reshape(-1, self.port.bytes + 1)
        bits = np.zeros((len(rows), self.bits), np.uint8)
        bits[:, : self.port.bits] = np.unpackbits(rows[:, :-1], axis=1, bitorder="little")[:, : self.port.bits]
        for place, flag in enumerate(self.flags, self.port.bits):
            bits[:, place] = rows[:, -1] >> flag & 1
        return np.packbits(bits, bitorder="little").tobytes()

    def plain(self, packed: bytes) -> bytes:
        """Return results as they are in ``SAMPLES`` and ``POLL``, those of which all bits are there."""
        bits = np.unpackbits(np.frombuffer(packed, np.uint8), bitorder="little").astype(np.int64)
        rows = bits[: len(bits) // self.bits * self.bits].reshape(-1, self.bits)
        codes = rows[:, : self.port.bits] @ (1 << np.arange(self.port.bits, dtype=np.int64))
        codes[codes > self.port.highest] -= 1 << self.port.bits
        status = sum((rows[:, place] << flag for place, flag in enumerate(self.flags, self.port.bits)), 0 * codes)
        return bytes_of(np.stack([codes, status], axis=1), [self.port.bytes, 1])
