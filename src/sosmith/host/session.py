"""A session of the protocol: requests within the window, and everything lost or damaged asked for again."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass, field

from sosmith.host.line import Line
from sosmith.model.errors import LinkError, LinkLostError, RefusedError
from sosmith.model.link.frames import Message, Receiver
from sosmith.model.link.protocol import RESPONSE, SEQUENCES, VERSION, WINDOWS, Counter, Status, Type

MAX_ATTEMPTS = 32
"""Times that a request is sent before the link counts as lost."""

OPEN_ATTEMPTS = 6
"""The same of the first request, which meets a board that may not be there."""

MAX_DAMAGED = 3
"""Copies of a response whose content is damaged, though its CRC is not, after which the board counts as faulty."""

_SHORTEST, _LONGEST, _FIRST = 0.02, 1.0, 0.3
"""Limits of the time in s to wait for a response before asking again, and what is waited for the first one."""

Request = tuple[Type, bytes]
"""Type and body."""

Check = Callable[[bytes], bool]
"""Tells whether the body of a response, without its status, can be right."""


def _anything(body: bytes) -> bool:
    return True


@dataclass
class Faults:
    """What went wrong on the host's side of a link, and was mended.

    Attributes
    ----------
    damaged : int
        Frames that arrived damaged, and responses whose content is.
    unexpected : int
        Messages that nothing was waiting for, such as second copies.
    gaps : int
        Responses that were missed because a later one came first.
    timeouts : int
        Times that no response came.
    """

    damaged: int = 0
    unexpected: int = 0
    gaps: int = 0
    timeouts: int = 0

    def as_dict(self) -> dict[str, int]:
        """Return the counts by their names."""
        return asdict(self)


@dataclass
class _Pending:
    """A request without a response."""

    message: Message
    sent: float
    check: Check = _anything
    again: bool = field(default=False)
    damaged: int = field(default=0)


class Session:
    """A session on a line.

    Parameters
    ----------
    line : Line
        The line.

    Raises
    ------
    LinkLostError
        If no board answers.
    LinkError
        If it speaks another version of the protocol.
    """

    def __init__(self, line: Line) -> None:
        self.faults = Faults()
        self.window = 1
        self._line = line
        self._receiver = Receiver()
        self._arrived: deque[Message | Counter] = deque()
        self._pending: deque[_Pending] = deque()
        self._sequence = 0
        self._round_trip: float | None = None
        self._drains = False  # nothing new is sent: the board may have dropped what it has not answered
        self._attempts = OPEN_ATTEMPTS
        body = self.request(Type.OPEN)
        self._attempts = MAX_ATTEMPTS
        if len(body) != 2 or body[0] != VERSION or body[1] not in WINDOWS:
            raise LinkError(f"the board must speak version {VERSION} of the protocol, not answer with {body.hex(' ')}")
        self.window = body[1]

    def request(self, kind: Type, body: bytes = b"", check: Check = _anything) -> bytes:
        """Send one request; return the body of its response without the status.

        A response that does not pass `check` is damage, as one with a wrong CRC, and is asked for again.

        Raises
        ------
        RefusedError
            If the status is not ``OK``.
        LinkLostError
            If no response comes, or the line is gone.
        LinkError
            If the response is still damaged when it came three times.
        """
        (response,) = self.exchange([(kind, body)], check)
        return response

    def exchange(self, requests: Iterable[Request], check: Check = _anything) -> Iterator[bytes]:
        """Send requests, as many at once as the board allows; give the bodies of the responses, in order.

        Errors are those of `request`. Requests are drawn as they are sent.
        """
        while self._pending:  # of a caller that stopped early
            self._next()
        source = iter(requests)
        more = True
        while True:
            self._drains = self._drains and bool(self._pending)
            while more and not self._drains and len(self._pending) < self.window:
                request = next(source, None)
                if request is None:
                    more = False
                else:
                    self._send(*request, check)
            if not self._pending:
                return
            request_message, body = self._next()
            yield _accepted(request_message, body)

    def _send(self, kind: Type, body: bytes, check: Check) -> None:
        message = Message(kind, self._sequence, body)
        self._sequence = (self._sequence + 1) % SEQUENCES
        self._pending.append(_Pending(message, time.monotonic(), check))
        self._line.write(message.frame)

    def _next(self) -> tuple[Message, bytes]:
        """Wait for the response to the oldest request; return that request and the body of the response."""
        attempt, asked, silent = 1, False, False
        deadline = time.monotonic() + self._patience(attempt)
        while True:
            while self._arrived:
                arrived = self._arrived.popleft()
                place = self._place(arrived)
                if place == 0 and isinstance(arrived, Message):
                    return self._finished(arrived)
                if place is not None and not asked:
                    # The board repeats the responses from this one on by itself.
                    self.faults.gaps += 1
                    asked = True
                    self._again(self._pending[0])
            if silent or time.monotonic() > deadline:
                self.faults.timeouts += 1
                if attempt == self._attempts:
                    raise LinkLostError(f"the board must answer, not be silent after {attempt} attempts")
                attempt, asked = attempt + 1, False
                # Not the others: copies of what is still on its way would be more than the credit.
                self._drains = True
                self._again(self._pending[0])
                deadline = time.monotonic() + self._patience(attempt)
            data = self._line.read(deadline - time.monotonic())
            silent = not data
            self._arrived.extend(self._receiver.feed(data))

    def _place(self, arrived: Message | Counter) -> int | None:
        """Index of the request that a message answers; counts what answers none."""
        if isinstance(arrived, Counter):
            self.faults.damaged += 1
            return None
        for place, pending in enumerate(self._pending):
            if (arrived.type, arrived.sequence) == (pending.message.type | RESPONSE, pending.message.sequence):
                if not arrived.body:
                    break
                if arrived.body[-1] != Status.OK or pending.check(arrived.body[:-1]):
                    return place
                self._damaged(pending)
                return None
        self.faults.unexpected += 1
        return None

    def _damaged(self, pending: _Pending) -> None:
        self.faults.damaged += 1
        pending.damaged += 1
        if pending.damaged == MAX_DAMAGED:
            name = Type(pending.message.type).name
            raise LinkError(
                f"the board must answer {name} with values within their fields, not {MAX_DAMAGED} times with bits "
                "outside of them"
            )

    def _finished(self, response: Message) -> tuple[Message, bytes]:
        pending = self._pending.popleft()
        if not pending.again:  # else it is not known which copy was answered
            taken = time.monotonic() - pending.sent
            self._round_trip = taken if self._round_trip is None else 0.75 * self._round_trip + 0.25 * taken
        return pending.message, response.body

    def _again(self, pending: _Pending) -> None:
        pending.again = True
        self._line.write(pending.message.frame)

    def _patience(self, attempt: int) -> float:
        """Seconds to wait for a response at the n-th attempt."""
        if self._round_trip is None:
            return _FIRST
        return max(
            min(max(4 * self._round_trip, _SHORTEST) * 2.0 ** min(attempt - 1, 8), _LONGEST), 2 * self._round_trip
        )


def _accepted(request: Message, body: bytes) -> bytes:
    if body[-1] == Status.OK:
        return body[:-1]
    name = Type(request.type).name
    try:
        meaning = Status(body[-1]).meaning
    except ValueError:
        meaning = f"status {body[-1]}"
    raise RefusedError(f"the board must carry out {name}, not answer: {meaning}")
