"""A host that lies to a board: frames that are damaged, foreign, late, doubled, or in order with any content."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from tests.edge import document_client as page
from tests.edge.document_client import ExpectedBoard

OPEN_OFTEN = 0.03
"""Share of the requests that begin a session: more, and none becomes old."""


@dataclass(frozen=True)
class Asked:
    """Bytes for a board.

    Attributes
    ----------
    data : bytes
        The bytes.
    hostile : bool
        Whether a host that keeps to the protocol never sends them.
    """

    data: bytes
    hostile: bool


def asked(board: ExpectedBoard, rng: random.Random, count: int) -> Iterator[Asked]:
    """Yield messages for a board, three of four of them hostile; `board` knows which number is the next one."""
    yield Asked(page.frame(page.OPEN, rng.randrange(256)), hostile=False)
    for _ in range(count):
        number = board.next or 0
        honest = _honest(number, rng)
        if rng.random() < 0.25:
            yield Asked(honest, hostile=False)
        else:
            yield Asked(rng.choice(_LIES)(honest, number, rng), hostile=True)


def _honest(number: int, rng: random.Random) -> bytes:
    if rng.random() < OPEN_OFTEN:
        return page.frame(page.OPEN, rng.randrange(256))
    kind = rng.choice((page.IDENTITY, page.SAMPLES, page.SAMPLES, page.COUNTERS))
    body = {page.IDENTITY: rng.randbytes(1), page.COUNTERS: b""}.get(
        kind, b"\0" + rng.randbytes(2 * rng.randint(1, 80))
    )
    return page.frame(kind, number, body)


def _damaged(honest: bytes, number: int, rng: random.Random) -> bytes:
    made = bytearray(honest)
    for _ in range(rng.randint(1, 4)):
        made[rng.randrange(len(made))] ^= 1 << rng.randrange(8)
    return bytes(made)


def _cut(honest: bytes, number: int, rng: random.Random) -> bytes:
    return honest[: rng.randrange(len(honest))] + rng.choice((b"", b"\0"))


def _any_content(honest: bytes, number: int, rng: random.Random) -> bytes:
    """Make a message in order, with any type and body."""
    length = rng.choice((0, 1, 2, 3, 4, 5, 8, 9, 64, 161, 162, 200, 241, 242))
    return page.frame(rng.choice((*range(12), 0x81, 0x83, 255)), number, rng.randbytes(length))


def _any_number(honest: bytes, number: int, rng: random.Random) -> bytes:
    """Make a request of before, or of none."""
    before = (number - rng.choice((1, 1, 2, 3, 4, 5, 17, rng.randrange(256)))) % 256
    return page.frame(rng.choice((page.IDENTITY, page.SAMPLES, page.COUNTERS, 77)), before, rng.randbytes(1))


def _wrong_length(honest: bytes, number: int, rng: random.Random) -> bytes:
    """Make a frame with a right CRC that is too short or too long for a message."""
    content = rng.randbytes(rng.choice((0, 1, 245, 246, 249)))
    return b"\0" + page.stuffed(page.with_crc(content)) + b"\0"


def _noise(honest: bytes, number: int, rng: random.Random) -> bytes:
    return rng.randbytes(rng.choice((1, 7, 60, 600)))


def _without_an_end(honest: bytes, number: int, rng: random.Random) -> bytes:
    return bytes(rng.randrange(1, 256) for _ in range(rng.choice((1, 255, 1000))))


def _open_with_a_body(honest: bytes, number: int, rng: random.Random) -> bytes:
    return page.frame(page.OPEN, rng.randrange(256), rng.randbytes(rng.randint(1, 242)))


_LIES: tuple[Callable[[bytes, int, random.Random], bytes], ...] = (
    _damaged,
    _damaged,
    _cut,
    _any_content,
    _any_content,
    _any_number,
    _any_number,
    _wrong_length,
    _noise,
    _without_an_end,
    _open_with_a_body,
)
