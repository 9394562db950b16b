"""The board's end of the link in software: it answers the protocol byte by byte, as the hardware does."""

from __future__ import annotations

from collections import deque
from typing import Protocol

from sosmith.model.link.frames import Message, Receiver
from sosmith.model.link.identity import Identity
from sosmith.model.link.protocol import (
    BLOCK_BYTES,
    RESPONSE,
    SEQUENCES,
    VERSION,
    WINDOWS,
    WORD_BYTES,
    Counter,
    Status,
    Type,
)


class Core(Protocol):
    """A core as the link sees it."""

    def reset(self) -> None:
        """Clear all states; loaded coefficients stay."""
        ...

    def feed(self, channel: int, samples: bytes) -> bytes:
        """Return the results of samples, the first of `channel` and the others of those that follow in turn.

        Each sample has as many as the identity says, one after the other.
        """
        ...

    def read(self, address: int) -> int | None:
        """Read a register; None if the core refuses."""
        ...

    def write(self, address: int, word: int) -> bool:
        """Write a register; False if the core refuses."""
        ...


class Device:
    """A board that is fed over the link.

    Parameters
    ----------
    identity : Identity
        What it says that it is.
    core : Core
        What it does with samples.
    window : int
        How many requests it allows to be without a response.

    Raises
    ------
    LinkError
        If a host would refuse the identity.
    """

    def __init__(self, identity: Identity, core: Core, *, window: int = 4) -> None:
        if window not in WINDOWS:
            raise ValueError(f"window must be one of {', '.join(map(str, WINDOWS))}, not {window}")
        self.counters = [0] * len(Counter)
        self._identity, self._core, self._window = identity, core, window
        self._memory = identity.memory
        Identity.of_memory(self._memory)
        self._receiver = Receiver()
        self._next: int | None = None  # before the first session
        self._retained: deque[Message] = deque(maxlen=window)

    def feed(self, data: bytes) -> bytes:
        """Take bytes of the line, whatever they are; return those that the board sends back."""
        return b"".join(self._answer(received) for received in self._receiver.feed(data))

    def _answer(self, received: Message | Counter) -> bytes:
        if isinstance(received, Counter):
            self._count(received)
            return b""
        if received.type == Type.OPEN:
            self._next = received.sequence
            self._retained.clear()
            self._core.reset()
        if self._next is None:
            self._count(Counter.SEQUENCE)
            return b""
        age = (self._next - received.sequence) % SEQUENCES
        if 0 < age <= len(self._retained):
            self._count(Counter.REPEATED)
            return b"".join(message.frame for message in list(self._retained)[-age:])
        if age:
            self._count(Counter.SEQUENCE)
            return b""
        self._next = (self._next + 1) % SEQUENCES
        content, status = self._carried_out(received)
        if status is not Status.OK:
            self._count(Counter.REFUSED)
        response = Message(received.type | RESPONSE, received.sequence, content + bytes([status]))
        self._retained.append(response)
        return response.frame

    def _count(self, counter: Counter) -> None:
        self.counters[counter] = (self.counters[counter] + 1) % 256

    def _carried_out(self, request: Message) -> tuple[bytes, Status]:
        """Carry out a request; return the body of its response and the status."""
        body = request.body
        packing = self._identity.packing
        if request.type == Type.SAMPLES:
            return self._samples(body, self._identity.samples)
        if request.type == Type.SAMPLES_PACKED and packing is not None:
            results, status = self._samples(body, packing.per_message(self._identity.sample_bytes))
            return packing.packed(results), status
        if request.type == Type.WRITE and self._identity.reload is not None:
            return b"", self._written(body)
        length = {Type.OPEN: 0, Type.IDENTITY: 1, Type.COUNTERS: 0}
        if self._identity.reload is not None:
            length[Type.READ] = 1
        if request.type not in length:
            return b"", Status.UNKNOWN
        kind = Type(request.type)
        if len(body) != length[kind]:
            return b"", Status.LENGTH
        if kind is Type.OPEN:
            return bytes([VERSION, self._window]), Status.OK
        if kind is Type.COUNTERS:
            return bytes(self.counters), Status.OK
        if kind is Type.IDENTITY:
            start = body[0] * BLOCK_BYTES % len(self._memory)
            return self._memory[start : start + BLOCK_BYTES], Status.OK
        word = self._core.read(body[0] & ~3)
        return (word or 0).to_bytes(WORD_BYTES, "little"), Status.REFUSED if word is None else Status.OK

    def _samples(self, body: bytes, most: int) -> tuple[bytes, Status]:
        size = self._identity.sample_bytes
        if not 0 < len(body) <= 1 + size * most:
            return b"", Status.LENGTH
        if body[0] >= self._identity.channels:
            return b"", Status.CHANNEL
        whole = (len(body) - 1) // size * size
        results = self._core.feed(body[0], body[1 : 1 + whole])
        return results, Status.OK if whole == len(body) - 1 else Status.LENGTH

    def _written(self, body: bytes) -> Status:
        if not body:
            return Status.LENGTH
        for start in range(1, len(body) - WORD_BYTES + 1, WORD_BYTES):
            if not self._core.write(body[0] & ~3, int.from_bytes(body[start : start + WORD_BYTES], "little")):
                return Status.REFUSED
        return Status.OK if (len(body) - 1) % WORD_BYTES == 0 else Status.LENGTH
