"""Watches a board: feeds it a trace in real time, or fetches what it measures; goes on when it was unplugged."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from sosmith.host.board import Board, Results
from sosmith.host.clock import Clock, HostClock, TimeBase
from sosmith.model.arrays import Codes
from sosmith.model.errors import LinkError, LinkLostError, ShortfallError, ToolError
from sosmith.model.link.identity import CONVERTER_FLAGS, Identity

RETRY = 0.5
"""Seconds between two attempts to find a board that was unplugged."""

TURN = 0.05
"""Seconds between two batches of samples, at least."""

(FAULT,) = CONVERTER_FLAGS
"""The flag of a result whose sample has a held code."""

MAX_BATCH = 2000
"""Most samples of a channel in a batch."""


MAX_FETCHED = 512
"""Most results of a board with converters in a batch: it keeps fewer, so that the last one of them is a new one."""


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
    start : float
        Time of sample 0 in seconds since 1970, by the time base of this session: that of sample n is n sample periods
        later.
    """

    session: int
    first: int
    results: Results
    start: float


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


@dataclass(frozen=True)
class Idle:
    """Nothing new: no board, or one without new results. Given in every pass of the loop, for what must not wait."""


Event = Connected | Received | Changed | Lost | Idle
_Batch = tuple[int, Results]


def watch(
    connect: Callable[[], Board],
    codes_for: Callable[[Identity], Codes],
    *,
    check: Callable[[Identity], None] = lambda identity: None,
    speed: float = 1.0,
    clock: Clock | None = None,
) -> Iterator[Event]:
    """Feed a board until the samples end, or fetch what it measures for ever; tell what happens.

    A sample whose result did not arrive before the board was lost is sent again in the next session, whose filter
    starts from reset. A board with converters is not fed; its samples are numbered as they arrive. All sessions are
    with the same board: what it says of itself does not change.

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
    clock : Clock or None
        Time; None for that of this computer.

    Raises
    ------
    ToolError
        If there is no board at first; later this is waited for.
    LinkError
        If a board refuses what it must carry out, or says what makes no sense, at any time.
    ShortfallError
        If there is another board than before, or `check` finds another one than expected.
    """
    clock = clock or HostClock()
    codes: Codes | None = None
    known: Identity | None = None
    faults = _Faults()
    session = sent = 0
    while True:
        board = _connected(connect, clock, wait=known is not None)
        if board is None:
            yield Idle()
            continue
        with board:
            _check_same(known, board.identity)
            check(board.identity)
            known = board.identity
            if known.source == "link" and codes is None:
                codes = codes_for(known)
            session += 1
            yield Connected(known, session)
            base, before = TimeBase(clock, known.result_rate), sent
            try:
                batches = (
                    _measured(board, sent, clock, base)
                    if codes is None
                    else _fed(board, codes, sent, speed, clock, base)
                )
                for batch in batches:
                    if batch is None:
                        yield Idle()
                        continue
                    first, results = batch
                    sent = first + len(results.codes)
                    yield Received(session, first, results, base.start)
                    if codes is None:
                        yield from faults.after(board, results)
            except LinkLostError as error:
                yield Lost(str(error))
            else:
                return
        if sent == before:  # else a board that answers and is lost again and again would be asked without a pause
            clock.sleep(RETRY)


def _connected(connect: Callable[[], Board], clock: Clock, *, wait: bool) -> Board | None:
    """Open the board; with `wait`, return None after a pause if it is not there."""
    try:
        return connect()
    except ToolError as error:
        nonsense = isinstance(error, LinkError) and not isinstance(error, LinkLostError)
        if nonsense or not wait:
            raise
        clock.sleep(RETRY)
        return None


def _check_same(known: Identity | None, identity: Identity) -> None:
    """Check that a board is the one of the sessions before."""
    if known is None or known == identity:
        return
    key = next(key for key in type(known).model_fields if getattr(known, key) != getattr(identity, key))
    before, now = (str(getattr(each, key)) for each in (known, identity))
    raise ShortfallError(
        f"the board must be the one of the sessions before, not another: its {key} is {now}, not {before}"
    )


class _Faults:
    """Tells when what is wrong with the readings of converters has changed."""

    def __init__(self) -> None:
        self._bad: dict[tuple[int, str], tuple[str, ...]] = {}

    def after(self, board: Board, results: Results) -> Iterator[Changed]:
        """Look after these results."""
        if not (self._bad or results.flag(FAULT).any()):
            return
        now = {place: faults for place, faults in board.readings().items() if faults}
        if now != self._bad:
            yield Changed({place: now.get(place, ()) for place in sorted({*self._bad, *now})})
        self._bad = now


def _measured(board: Board, start: int, clock: Clock, base: TimeBase) -> Iterator[_Batch | None]:
    """Fetch results, and give those of samples of which all channels are there; number them from `start` on.

    None when there are no new ones.
    """
    fetched, taken = _Fetched(board), start
    while True:
        lost: LinkError | None = None
        try:
            moment = fetched.fetch(clock)
        except LinkError as error:  # what came before it counts
            moment, lost = clock.monotonic(), error
        results = fetched.whole()
        if results is not None:
            base.came(taken + len(results.codes) - 1, moment)
            yield taken, results
            taken += len(results.codes)
        if lost is not None:
            raise lost
        if results is None:
            yield None
            clock.sleep(TURN)


class _Fetched:
    """Results of a board with converters, put together to whole samples."""

    def __init__(self, board: Board) -> None:
        self._board, self._channels = board, board.identity.channels
        self._codes: list[int] = []
        self._status: list[int] = []

    def fetch(self, clock: Clock) -> float:
        """Fetch what there is; return when the last of it came."""
        moment = clock.monotonic()
        for fetched in self._board.poll_all(MAX_FETCHED):
            moment = clock.monotonic()
            self._take(*fetched)
        return moment

    def _take(self, channel: int, results: Results) -> None:
        skipped = 0
        if channel != len(self._codes) % self._channels:  # some were overwritten: go on with the next whole sample
            kept = len(self._codes) // self._channels * self._channels
            self._codes, self._status = self._codes[:kept], self._status[:kept]
            skipped = -channel % self._channels
        self._codes += results.codes[skipped:].tolist()
        self._status += results.status[skipped:].tolist()

    def whole(self) -> Results | None:
        """Take the whole samples; None if there is none."""
        count = len(self._codes) // self._channels * self._channels
        if not count:
            return None
        shape = (-1,) if self._channels == 1 else (-1, self._channels)
        codes = np.array(self._codes[:count], np.int64).reshape(shape)
        status = np.array(self._status[:count], np.uint8).reshape(shape)
        self._codes, self._status = self._codes[count:], self._status[count:]
        about = self._board.identity
        return Results(values=about.output_port.decode(codes), codes=codes, status=status, flags=dict(about.flags))


def _fed(board: Board, codes: Codes, start: int, speed: float, clock: Clock, base: TimeBase) -> Iterator[_Batch | None]:
    """Feed samples as they become due, from the one with result number `start` on; give each batch's first number."""
    each = board.identity.results
    base.begin(start)
    start //= each
    begun, sent, rate = clock.monotonic(), start, board.identity.sample_rate * speed
    while sent < len(codes):
        due = len(codes) if rate == 0 else min(start + int((clock.monotonic() - begun) * rate) + 1, len(codes))
        end = min(due, sent + MAX_BATCH)
        if end > sent:
            yield sent * each, board.run_codes(codes[sent:end])
            sent = end
        else:
            yield None
        if rate and sent < len(codes):
            clock.sleep(max(begun + (sent - start) / rate - clock.monotonic(), TURN))
