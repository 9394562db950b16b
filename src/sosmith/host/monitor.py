"""Watches a board: feeds it a trace in real time, or fetches what it measures; goes on when it was unplugged."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sosmith.host.board import Board, Results
from sosmith.model.arrays import Codes
from sosmith.model.errors import LinkError, ToolError
from sosmith.model.link.identity import CONVERTER_FLAGS, Identity

RETRY = 0.5
"""Seconds between two attempts to find a board that was unplugged."""

TURN = 0.05
"""Seconds between two batches of samples, at least."""

(FAULT,) = CONVERTER_FLAGS
"""The flag of a result whose sample has a held code."""

MAX_BATCH = 2000
"""Most samples of a channel in a batch."""


class Clock(Protocol):
    """The passing of time; the module `time` is one."""

    def monotonic(self) -> float:
        """Return seconds since some moment."""
        ...

    def sleep(self, seconds: float, /) -> None:
        """Wait."""
        ...


@dataclass(frozen=True)
class Connected:
    """A session with a board has begun; a core that is fed over the link starts from reset.

    Attributes
    ----------
    identity : Identity
        What the board is.
    session : int
        Number of the session, from 1.
    """

    identity: Identity
    session: int


@dataclass(frozen=True)
class Received:
    """Results of consecutive samples.

    Attributes
    ----------
    session : int
        Number of the session.
    first : int
        Number of the first sample, from 0, across sessions.
    results : Results
        The results, one row for each sample.
    """

    session: int
    first: int
    results: Results


@dataclass(frozen=True)
class Lost:
    """The board is gone, for the moment.

    Attributes
    ----------
    reason : str
        What happened.
    """

    reason: str


@dataclass(frozen=True)
class Changed:
    """Readings of converters have gone bad, or are good again.

    Attributes
    ----------
    readings : dict
        What is wrong with each reading that was or is bad, by channel and input, as `Board.readings` has it.
    """

    readings: dict[tuple[int, str], tuple[str, ...]]


Event = Connected | Received | Changed | Lost


def watch(
    connect: Callable[[], Board],
    codes_for: Callable[[Identity], Codes],
    *,
    check: Callable[[Identity], None] = lambda identity: None,
    speed: float = 1.0,
    clock: Clock = time,
) -> Iterator[Event]:
    """Feed a board until the samples end, or fetch what it measures for ever; tell what happens.

    A sample whose result did not arrive before the board was lost is sent again in the next session, whose filter
    starts from reset. A board with converters is not fed; its samples are numbered as they arrive.

    Parameters
    ----------
    connect : callable
        Opens the board.
    codes_for : callable
        Returns the samples for a board, shape (samples, channels, inputs); called once, for one that is fed.
    check : callable
        Called with the identity at the beginning of each session; may raise.
    speed : float
        1 for real time, by the board's sample rate; 0 for as fast as the line takes them.
    clock : Clock
        Time.

    Raises
    ------
    ToolError
        If there is no board at first; later this is waited for.
    ShortfallError
        If `check` finds another board than expected.
    """
    codes: Codes | None = None
    bad: dict[tuple[int, str], tuple[str, ...]] = {}
    session = sent = 0
    while True:
        try:
            board = connect()
        except ToolError:
            if session == 0:
                raise
            clock.sleep(RETRY)
            continue
        with board:
            check(board.identity)
            if board.identity.source == "link" and codes is None:
                codes = codes_for(board.identity)
            session += 1
            yield Connected(board.identity, session)
            rate = board.identity.sample_rate * speed
            try:
                batches = _measured(board, sent, clock) if codes is None else _fed(board, codes, sent, rate, clock)
                for first, results in batches:
                    sent = first + len(results.codes)
                    yield Received(session, first, results)
                    if codes is None and (bad or results.flag(FAULT).any()):
                        now = {place: faults for place, faults in board.readings().items() if faults}
                        if now != bad:
                            yield Changed({place: now.get(place, ()) for place in sorted({*bad, *now})})
                        bad = now
            except LinkError as error:
                yield Lost(str(error))
            else:
                return


def _measured(board: Board, start: int, clock: Clock) -> Iterator[tuple[int, Results]]:
    """Fetch results, and give those of samples of which all channels are there; number them from `start` on."""
    channels, taken = board.identity.channels, start
    codes: list[int] = []
    status: list[int] = []
    while True:
        found = board.poll()
        if found is None:
            clock.sleep(TURN)
            continue
        channel, results = found
        if channel != len(codes) % channels:  # some were overwritten: begin with the next whole sample
            codes, status = [], []
            skipped = -channel % channels
        else:
            skipped = 0
        codes += results.codes[skipped:].tolist()
        status += results.status[skipped:].tolist()
        whole = len(codes) // channels * channels
        if whole:
            shape = (-1,) if channels == 1 else (-1, channels)
            shaped = np.array(codes[:whole], np.int64).reshape(shape)
            yield (
                taken,
                Results(
                    values=board.identity.output_port.decode(shaped),
                    codes=shaped,
                    status=np.array(status[:whole], np.uint8).reshape(shape),
                    flags=results.flags,
                ),
            )
            codes, status, taken = codes[whole:], status[whole:], taken + whole // channels


def _fed(board: Board, codes: Codes, start: int, rate: float, clock: Clock) -> Iterator[tuple[int, Results]]:
    """Feed the samples from number `start` on, as they become due; give the number of the first one of each batch."""
    begun, sent = clock.monotonic(), start
    while sent < len(codes):
        due = len(codes) if rate == 0 else min(start + int((clock.monotonic() - begun) * rate) + 1, len(codes))
        end = min(due, sent + MAX_BATCH)
        if end > sent:
            yield sent, board.run_codes(codes[sent:end])
            sent = end
        if rate and sent < len(codes):
            clock.sleep(max(begun + (sent - start) / rate - clock.monotonic(), TURN))
