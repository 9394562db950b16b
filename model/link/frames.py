"""Frames of the link: a message with its CRC-32, encoded with COBS between two zero bytes."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

from cobs import cobs

from sosmith.model.link.protocol import CRC_BYTES, HEAD_BYTES, MAX_BODY, MAX_MESSAGE, MIN_MESSAGE, Counter

DELIMITER = b"\0"


@dataclass(frozen=True)
class Message:
    """A message: type and sequence number, one byte each, and a body of at most `MAX_BODY` bytes."""

    type: int
    sequence: int
    body: bytes = b""

    def __post_init__(self) -> None:
        if len(self.body) > MAX_BODY:
            raise ValueError(f"body must have at most {MAX_BODY} bytes, not {len(self.body)}")

    @property
    def checked(self) -> bytes:
        """The bytes of the message, with its CRC."""
        content = bytes([self.type, self.sequence]) + self.body
        return content + zlib.crc32(content).to_bytes(CRC_BYTES, "little")

    @property
    def frame(self) -> bytes:
        """The bytes on the line."""
        encoded: bytes = cobs.encode(self.checked)
        return DELIMITER + encoded + DELIMITER


def decoded(encoded: bytes) -> Message | Counter:
    """Decode what lies between two zero bytes; return the message, or the counter of what is wrong with it."""
    try:
        checked = cobs.decode(encoded)
    except cobs.DecodeError:
        return Counter.MALFORMED
    if not MIN_MESSAGE <= len(checked) <= MAX_MESSAGE:
        return Counter.MALFORMED
    content, crc = checked[:-CRC_BYTES], checked[-CRC_BYTES:]
    if zlib.crc32(content).to_bytes(CRC_BYTES, "little") != crc:
        return Counter.CRC
    return Message(content[0], content[1], content[HEAD_BYTES:])


class Receiver:
    """Finds frames in a stream of bytes, whatever that holds; it never keeps more than one frame's bytes."""

    def __init__(self) -> None:
        self._pending = bytearray()

    def feed(self, data: bytes) -> list[Message | Counter]:
        """Take the next bytes of the stream; return what `decoded` returns for each frame that they complete."""
        received = []
        *complete, rest = data.split(DELIMITER)
        for part in complete:
            self._keep(part)
            if self._pending:
                received.append(decoded(bytes(self._pending)))
                self._pending.clear()
        self._keep(rest)
        return received

    def _keep(self, part: bytes) -> None:
        # One byte more than the longest frame tells that this one is too long.
        self._pending += part[: MAX_MESSAGE + 2 - len(self._pending)]
