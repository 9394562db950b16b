"""A board that lies: about itself, in its frames, with its results, and by another board at its place or none."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from sosmith.model.errors import LinkLostError, ToolError
from sosmith.model.link.device import Device
from sosmith.model.link.frames import Message, Receiver
from sosmith.model.link.identity import Identity
from sosmith.model.link.protocol import MAX_BODY, MAX_IDENTITY, RESPONSE, Type
from tests.host.lines import plain_device
from tests.host.measuring import MeasuringDevice, measuring_identity

NUMBERS = (0, -1, 1, 256, 2**32, 2**63, 10**400, 1e-12, 1e-300, 5e-324, 1e308, 1e13, float("inf"), float("nan"), True)
TEXTS = (
    "",
    "\x1b]0;owned\x07\x1b[2J",
    "a\nsosmith: all is well",
    "../../gauge",
    "fleet/#",
    "a+b",
    "=cmd()",
    'a,b"c',
    "\u202egnp.exe",
    "\0",
    "\ud800",
    "x" * 500,
    "utc",
    "time_s",
)
OTHERS = (None, [], {}, [[]], {"a": 1})


class Clock:
    """Time that passes while somebody waits for it, to an end; now and then somebody sets the clock."""

    def __init__(self, end: float, rng: random.Random) -> None:
        self.now, self._end, self._rng = 0.0, end, rng
        self._set = 1e9

    def time(self) -> float:
        return self._set + self.now

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float, /) -> None:
        self.now += seconds
        if self._rng.random() < 0.05:
            self._set += self._rng.choice((-9e8, -3600.0, -0.5, 3600.0))
        if self.now > self._end:
            raise EnoughError("the test must end, not go on")


class EnoughError(ToolError):
    """What stands for Ctrl-C, where a monitor waits for a board that does not come back."""


@dataclass
class Counts:
    """What a board has said.

    Attributes
    ----------
    messages : int
        Messages.
    lies : int
        Those among them that were no honest ones.
    strange : int
        Results that another board than the first was asked for.
    """

    messages: int = 0
    lies: int = 0
    strange: int = 0


def false_identity(memory: bytes, rng: random.Random) -> bytes:
    """Return an identity with one lie."""
    text = memory.rstrip(b"\0")
    kind = rng.randrange(5)
    if kind == 0:
        place = rng.randrange(len(text))
        return text[:place] + rng.randbytes(rng.randint(1, 4)) + text[place + 1 :]
    if kind == 1:
        return text[: rng.randrange(len(text))]
    if kind == 2:
        key = rng.choice(sorted(json.loads(text)))
        return text[:-1] + f",{json.dumps(key)}:{json.dumps(rng.choice(TEXTS))}}}".encode()
    if kind == 3:
        return rng.choice([b"[" * 1000, b"{}", b"null", b"\xff\xfe", b"1e999", rng.randbytes(900)])
    tree = json.loads(text)
    place: Any = tree
    at: Any = rng.choice(sorted(tree))
    while isinstance(place[at], list | dict) and place[at] and rng.random() < 0.8:
        place = place[at]
        at = rng.choice(sorted(place) if isinstance(place, dict) else range(len(place)))
    lie = rng.choice(rng.choice((NUMBERS, TEXTS, OTHERS)))
    if isinstance(place, dict) and rng.random() < 0.3 and isinstance(lie, str):
        place[lie] = place.pop(at)
    else:
        place[at] = lie
    return json.dumps(tree, ensure_ascii=rng.random() < 0.5).encode(errors="surrogatepass")


def with_memory(device: Device, memory: bytes) -> Device:
    """Let a board say that; every board has whole blocks."""
    size = 1 << max(len(memory) - 1, 63).bit_length()
    device._memory = memory.ljust(min(size, 2 * MAX_IDENTITY), b"\0")
    return device


class LyingLine:
    """A line to a board that lies in one of several messages, and can be gone for good.

    Parameters
    ----------
    device : Device
        The board.
    rng : Random
        Chance.
    counts : Counts
        Renewed with each message.
    often : float
        Share of the messages that are lies.
    stranger : bool
        Whether this is another board than the first.
    """

    def __init__(self, device: Device, rng: random.Random, counts: Counts, often: float, stranger: bool) -> None:
        self._stranger = stranger
        self._device, self._rng, self._counts, self._often = device, rng, counts, often
        self._waiting = bytearray()
        self._ends = rng.choice((None, None, rng.randint(1, 600)))
        self._silent = rng.random() < 0.5
        self._lies = rng.choice((LIES, MENDED, MENDED))

    def write(self, data: bytes) -> None:
        if self._ends is not None:
            self._ends -= 1
            if self._ends < 0:
                if not self._silent:
                    raise LinkLostError("the line must stay connected, not: unplugged")
                return
        for found in Receiver().feed(self._device.feed(data)):
            assert isinstance(found, Message)
            self._counts.messages += 1
            self._counts.strange += self._stranger and found.type & ~RESPONSE in {Type.SAMPLES, Type.POLL}
            if self._rng.random() >= self._often:
                self._waiting += found.frame
            else:
                self._counts.lies += 1
                self._waiting += self._rng.choice(self._lies)(found, self._rng)

    def read(self, timeout: float) -> bytes:
        data = bytes(self._waiting)
        self._waiting.clear()
        return data

    def close(self) -> None:
        self._waiting.clear()


def _damaged(message: Message, rng: random.Random) -> bytes:
    frame = bytearray(message.frame)
    for _ in range(rng.randint(1, 3)):
        frame[rng.randrange(len(frame))] ^= 1 << rng.randrange(8)
    return bytes(frame)


def _other_body(message: Message, rng: random.Random) -> bytes:
    """Return a frame in order with any content."""
    body = rng.randbytes(rng.choice((0, 1, 2, 3, 9, 64, 65, len(message.body), MAX_BODY)))
    status = b"\0" if rng.random() < 0.7 else b""
    return Message(message.type, message.sequence, body[: MAX_BODY - 1] + status).frame


def _stray_bits(message: Message, rng: random.Random) -> bytes:
    body = bytearray(message.body)
    body[rng.randrange(len(body))] ^= 1 << rng.randrange(8)
    return Message(message.type, message.sequence, bytes(body)).frame


def _refused(message: Message, rng: random.Random) -> bytes:
    return Message(message.type, message.sequence, bytes([rng.randrange(256)])).frame


def _of_others(message: Message, rng: random.Random) -> bytes:
    """Return what nobody has asked for, with or without what somebody has."""
    kind, number = rng.choice([*Type, 0, 99]), rng.randrange(256)
    stranger = Message(kind | rng.choice((0, RESPONSE)), number, rng.randbytes(rng.randrange(80))).frame
    return rng.choice((stranger, stranger + message.frame, message.frame * 3))


def _noise(message: Message, rng: random.Random) -> bytes:
    return rng.randbytes(rng.choice((1, 100, 5000))) + rng.choice((b"", message.frame))


def _nothing(message: Message, rng: random.Random) -> bytes:
    return b""


Lie = Callable[[Message, random.Random], bytes]
MENDED: tuple[Lie, ...] = (_damaged, _of_others, _noise, _nothing)
"""Lies that a session mends, unless they come too often."""
LIES: tuple[Lie, ...] = (_damaged, _other_body, _stray_bits, _refused, _of_others, _noise, _nothing)


@dataclass
class LyingPort:
    """A port with a lying board, or with another one each time that it is opened.

    Parameters
    ----------
    seed : int
        Seed of all chance.

    Attributes
    ----------
    honest : Identity
        What the board says when it does not lie.
    clock : Clock
        Its time.
    counts : Counts
        What it has said.
    """

    seed: int
    counts: Counts = field(default_factory=Counts)

    def __post_init__(self) -> None:
        self._rng = random.Random(self.seed)
        self.clock = Clock(20.0, random.Random(self.seed))
        self.measures = self.seed % 3 != 0
        self.honest = measuring_identity(self._rng.choice((1, 3))) if self.measures else fed_identity()
        self._lies_about_itself = self._rng.random() < 0.3
        self._often = self._rng.choice((0.02, 0.1, 0.3, 0.6))
        self._device = self._board(self.honest)
        self._opened = 0

    def open(self, port: str, baud: int) -> LyingLine:
        """Return the line, as the serial port does."""
        self._opened += 1
        device, stranger = self._device, False
        if self._opened > 1 and self._rng.random() < 0.2:
            raise ToolError(f"{port} must be a serial port that is free, not: No such file or directory")
        if self._opened > 1 and self._rng.random() < 0.3:
            device, stranger = self._board(self._another()), True
        if self._lies_about_itself and self._rng.random() < 0.7:
            self.counts.lies += 1
            device = with_memory(self._board(self.honest), false_identity(self.honest.memory, self._rng))
        return LyingLine(device, self._rng, self.counts, self._often, stranger)

    def _another(self) -> Identity:
        output = self.honest.output
        changes = self._rng.choice(
            (
                {"design": "0" * 64},
                {"name": "other"},
                {"output": (*output[:4], 2 * output[4], output[5])},
                {"flags": {flag: 7 - bit for flag, bit in self.honest.flags.items()}},
            )
        )
        return Identity.model_validate(self.honest.model_dump() | changes)

    def _board(self, identity: Identity) -> Device:
        if not self.measures:
            return Device(identity, plain_device()._core)
        device = MeasuringDevice(self.clock.monotonic, identity)
        device.status = self._rng.choice((0, 0, 0x40))
        return device


@cache
def fed_identity() -> Identity:
    """Return the identity of a board that is fed."""
    return plain_device()._identity
