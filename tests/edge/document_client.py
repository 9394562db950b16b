"""What docs/protocol.md says, written from that page alone: frames, a client, and what a board must answer.

Nothing of the house is imported here, so that a fault of the document, of the host or of the board shows.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

OPEN, IDENTITY, SAMPLES, POLL, READ, WRITE, COUNTERS, CONVERTERS = range(1, 9)
OK, UNKNOWN, LENGTH, CHANNEL, REFUSED = range(5)
FRAMING, MALFORMED, CRC, SEQUENCE, REPEATED, OVERRUN, REFUSED_COUNT, MISSED = range(8)
LONGEST_BODY, SHORTEST, LONGEST = 242, 6, 248
"""Most bytes of a body; fewest and most of a message."""


class Core(Protocol):
    """A core behind the link."""

    def reset(self) -> None:
        """Begin anew."""
        ...

    def feed(self, channel: int, samples: bytes) -> bytes:
        """Return the results of samples."""
        ...

    def read(self, address: int) -> int | None:
        """Read a register; None if it is refused."""
        ...

    def write(self, address: int, word: int) -> bool:
        """Write a register; False if it is refused."""
        ...


def crc32(data: bytes) -> int:
    """CRC-32 of IEEE 802.3, bit by bit: reflected, so that the polynomial 0x04C11DB7 reads 0xEDB88320."""
    rest = 0xFFFFFFFF
    for byte in data:
        rest ^= byte
        for _ in range(8):
            rest = rest >> 1 ^ (0xEDB88320 if rest & 1 else 0)
    return rest ^ 0xFFFFFFFF


def frame(kind: int, sequence: int, body: bytes = b"") -> bytes:
    """Return a message on the line."""
    return b"\0" + stuffed(with_crc(bytes([kind, sequence]) + body)) + b"\0"


def with_crc(content: bytes) -> bytes:
    """Return a message with its CRC behind it."""
    return content + crc32(content).to_bytes(4, "little")


def stuffed(message: bytes) -> bytes:
    """Encode a message of at most 253 bytes: each zero byte becomes the distance to the next one, or to the end."""
    made = bytearray(b"\0" + message)
    last = len(made)
    for place in range(len(message), -1, -1):
        if made[place] == 0:
            made[place] = last - place
            last = place
    return bytes(made)


def unstuffed(encoded: bytes) -> bytes | None:
    """Decode what lies between two zero bytes; None if its last block is not complete."""
    made, place = bytearray(), 0
    while place < len(encoded):
        distance = encoded[place]
        if place + distance > len(encoded):
            return None
        made += encoded[place + 1 : place + distance]
        place += distance
        if place < len(encoded) and distance < 255:
            made.append(0)
    return bytes(made)


class Frames:
    """Finds messages in bytes from a line."""

    def __init__(self) -> None:
        self._open = bytearray()

    def feed(self, data: bytes) -> list[tuple[int, int, bytes] | int]:
        """Return type, sequence number and body of each message, or the counter of what is wrong with a frame."""
        found: list[tuple[int, int, bytes] | int] = []
        for byte in data:
            if byte:
                self._open.append(byte)
            elif self._open:
                found.append(self._message(bytes(self._open)))
                self._open.clear()
        return found

    def _message(self, encoded: bytes) -> tuple[int, int, bytes] | int:
        message = unstuffed(encoded)
        if message is None or not SHORTEST <= len(message) <= LONGEST:
            return MALFORMED
        if crc32(message[:-4]) != int.from_bytes(message[-4:], "little"):
            return CRC
        return message[0], message[1], message[2:-4]


class ExpectedBoard:
    """Says what a board must answer to any bytes.

    Parameters
    ----------
    core : Core
        The core in it.
    identity : bytes
        What is in its memory, as many bytes as a power of two.
    sizes : tuple of int
        Bytes of a sample, samples in a message, and channels.
    registers : bool
        Whether the core has registers.
    window : int
        How many requests may be without a response.

    Attributes
    ----------
    next : int or None
        Sequence number of the next request; None before the first session.
    counters : list of int
        The counters.
    """

    def __init__(
        self, core: Core, identity: bytes, sizes: tuple[int, int, int], *, registers: bool = False, window: int = 4
    ) -> None:
        self._core, self._identity, self._window = core, identity, window
        self._size, self._most, self._channels = sizes
        self._frames = Frames()
        self._retained: list[tuple[int, bytes]] = []
        self.next: int | None = None
        self.counters = [0] * 8
        self._carry: dict[int, Callable[[bytes], tuple[bytes, int]]] = {
            OPEN: lambda body: (bytes([1, window]), OK) if not body else (b"", LENGTH),
            IDENTITY: self._block,
            SAMPLES: self._samples,
            COUNTERS: lambda body: (bytes(self.counters), OK) if not body else (b"", LENGTH),
        }
        if registers:
            self._carry |= {READ: self._read, WRITE: self._write}

    def feed(self, data: bytes) -> bytes:
        """Return the bytes that the board sends back."""
        return b"".join(map(self._answer, self._frames.feed(data)))

    def _answer(self, found: tuple[int, int, bytes] | int) -> bytes:
        if isinstance(found, int):
            self._count(found)
            return b""
        kind, sequence, body = found
        if kind == OPEN:
            self.next, self._retained = sequence, []
            self._core.reset()
        if sequence == self.next:
            self.next = (sequence + 1) % 256
            content, status = self._carry.get(kind, lambda body: (b"", UNKNOWN))(body)
            if status != OK:
                self._count(REFUSED_COUNT)
            response = frame(kind | 0x80, sequence, content + bytes([status]))
            self._retained = [*self._retained, (sequence, response)][-self._window :]
            return response
        for place, (number, _) in enumerate(self._retained):
            if number == sequence:
                self._count(REPEATED)
                return b"".join(response for _, response in self._retained[place:])
        self._count(SEQUENCE)
        return b""

    def _count(self, counter: int) -> None:
        self.counters[counter] = (self.counters[counter] + 1) % 256

    def _block(self, body: bytes) -> tuple[bytes, int]:
        if len(body) != 1:
            return b"", LENGTH
        start = body[0] * 64 % len(self._identity)
        return self._identity[start : start + 64], OK

    def _samples(self, body: bytes) -> tuple[bytes, int]:
        whole, rest = divmod(len(body) - 1, self._size)
        if not body or whole > self._most or (whole == self._most and rest):
            return b"", LENGTH
        if body[0] >= self._channels:
            return b"", CHANNEL
        return self._core.feed(body[0], body[1 : 1 + whole * self._size]), LENGTH if rest else OK

    def _read(self, body: bytes) -> tuple[bytes, int]:
        if len(body) != 1:
            return b"", LENGTH
        word = self._core.read(body[0] & 0xFC)
        return (word or 0).to_bytes(4, "little"), REFUSED if word is None else OK

    def _write(self, body: bytes) -> tuple[bytes, int]:
        if not body:
            return b"", LENGTH
        whole, rest = divmod(len(body) - 1, 4)
        for n in range(whole):
            if not self._core.write(body[0] & 0xFC, int.from_bytes(body[1 + 4 * n : 5 + 4 * n], "little")):
                return b"", REFUSED
        return b"", LENGTH if rest else OK
