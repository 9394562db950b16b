"""The messages of the link, their status codes and the counters of faults, described once for hardware and host.

A message is a type, a sequence number, a body of up to `MAX_BODY` bytes, and a CRC-32; docs/protocol.md says how a
frame is made of it, and what both ends do.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

VERSION = 1
"""Version of the protocol, in the response to ``OPEN``."""

MAX_BODY = 242
"""Most bytes of a body."""

HEAD_BYTES, CRC_BYTES = 2, 4
"""Type and sequence number before the body; the CRC behind it."""

MIN_MESSAGE, MAX_MESSAGE = HEAD_BYTES + CRC_BYTES, HEAD_BYTES + MAX_BODY + CRC_BYTES
"""Fewest and most bytes of a message."""

MAX_FRAME = MAX_MESSAGE + 3
"""Most bytes of a frame: COBS adds one, and two zero bytes are around it."""

LINE_BITS = 10
"""Bits of the line for a byte, with start and stop bit."""

RESPONSE = 0x80
"""The bit that is set in the type of a response."""

SEQUENCES = 256
"""Sequence numbers count modulo this."""

WINDOWS = (2, 4, 8, 16)
"""Numbers of requests that a device may allow to be without a response."""

BLOCK_BYTES = 64
"""Bytes of the identity in one response."""

MAX_IDENTITY = 1024
"""Most bytes of the identity, including the zero byte at its end."""

WORD_BYTES = 4
"""Bytes of a register, the lowest one first."""

MAX_WORDS = (MAX_BODY - 1) // WORD_BYTES
"""Most words in one ``WRITE``."""


class Type(IntEnum):
    """Types of requests."""

    OPEN = 1
    IDENTITY = 2
    SAMPLES = 3
    POLL = 4
    READ = 5
    WRITE = 6
    COUNTERS = 7
    CONVERTERS = 8
    SAMPLES_PACKED = 9
    POLL_PACKED = 10


class Status(IntEnum):
    """Last byte of a response's body: what became of the request."""

    OK = 0
    UNKNOWN = 1
    LENGTH = 2
    CHANNEL = 3
    REFUSED = 4

    @property
    def meaning(self) -> str:
        """The meaning, as a sentence without its stop."""
        return _STATUS[self]


_STATUS = {
    Status.OK: "the request was carried out",
    Status.UNKNOWN: "the device has no such request; nothing was carried out",
    Status.LENGTH: "the body does not have a length that the request allows; complete samples or words before its end "
    "were carried out",
    Status.CHANNEL: "there is no such channel; nothing was carried out",
    Status.REFUSED: "the core refused an access to its registers; words before it were written, those behind were not",
}


class Counter(IntEnum):
    """Counters of faults: the position of each in the response to ``COUNTERS``, one byte that wraps around."""

    FRAMING = 0
    MALFORMED = 1
    CRC = 2
    SEQUENCE = 3
    REPEATED = 4
    OVERRUN = 5
    REFUSED = 6
    MISSED = 7

    @property
    def meaning(self) -> str:
        """What is counted."""
        return _COUNTERS[self]


_COUNTERS = {
    Counter.FRAMING: "bytes with a wrong stop bit",
    Counter.MALFORMED: "frames whose last COBS block is not complete, and messages with fewer bytes than "
    f"{MIN_MESSAGE} or more than {MAX_MESSAGE}",
    Counter.CRC: "messages with a wrong CRC",
    Counter.SEQUENCE: "messages with a sequence number that is neither the next one nor that of a retained response",
    Counter.REPEATED: "requests that came again, and were answered again",
    Counter.OVERRUN: "frames that began while no buffer was free",
    Counter.REFUSED: "responses with another status than `OK`",
    Counter.MISSED: "results of converters that were overwritten before a `POLL` fetched them",
}


@dataclass(frozen=True)
class Layout:
    """What a request does, and what its body and that of its response hold, the latter without the status."""

    request: str
    response: str
    text: str


LAYOUTS = {
    Type.OPEN: Layout(
        "nothing",
        "`version`, `window`",
        "Begins a session: sequence numbers start again, what was pending and what was retained is forgotten, and a "
        "core that is fed over the link is reset.",
    ),
    Type.IDENTITY: Layout(
        "`block`",
        f"{BLOCK_BYTES} bytes",
        f"Gives a block of the identity: JSON in UTF-8, followed by zero bytes, at most {MAX_IDENTITY} bytes in all. "
        "Block numbers wrap around at the end of the memory.",
    ),
    Type.SAMPLES: Layout(
        "`channel`, samples",
        "results",
        "Feeds samples to the core, and returns a result for each, in the same order, or as many for each as `results` "
        "of the identity says, one after the other. The first sample is of `channel`, the others of the channels that "
        "follow it in turn, the first after the last. As many as fit both bodies. "
        "Unknown to a device with converters.",
    ),
    Type.POLL: Layout(
        "nothing",
        "`channel`, results",
        "Fetches the oldest results that have not been fetched, as many as there are, and fit; channels as for "
        "`SAMPLES`. Unknown to a device without converters.",
    ),
    Type.READ: Layout(
        "`address`",
        "`word`",
        "Reads a register of the core; the lowest two bits of the address are ignored. The word is undefined unless "
        "the status is `OK`. Unknown to a core without registers.",
    ),
    Type.WRITE: Layout(
        "`address`, words",
        "nothing",
        f"Writes up to {MAX_WORDS} words, one after another, to the same register, up to the first one that is "
        "refused. Unknown to a core without registers.",
    ),
    Type.COUNTERS: Layout(
        "nothing",
        f"{len(Counter)} bytes",
        "Gives the counters of faults; they are not set back.",
    ),
    Type.CONVERTERS: Layout(
        "nothing",
        "a byte for each input of each channel",
        "Gives what was wrong with the last reading of each converter, those of channel 0 first. Unknown to a device "
        "without converters.",
    ),
    Type.SAMPLES_PACKED: Layout(
        "`channel`, samples",
        "packed results",
        "As `SAMPLES`, with packed results. Unknown to a device whose identity has no `packed`.",
    ),
    Type.POLL_PACKED: Layout(
        "nothing",
        "`channel`, packed results",
        "As `POLL`, with packed results. Unknown to a device whose identity has no `packed`.",
    ),
}
"""The requests, in the order of their numbers."""


def samples_per_message(sample_bytes: int, result_bytes: int) -> int:
    """Return how many samples fit a ``SAMPLES`` request of `sample_bytes` each, and its response."""
    return (MAX_BODY - 1) // max(sample_bytes, result_bytes)


def results_per_second(baud: int, results: int) -> float:
    """Return how many results a second a line carries in frames of `results` each that are as long as any."""
    return baud / LINE_BITS * results / MAX_FRAME
