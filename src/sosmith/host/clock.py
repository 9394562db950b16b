"""Time as a monitor sees it: the host's clocks, and the times of the samples of one session."""

from __future__ import annotations

import time
from datetime import UTC, datetime
from typing import Protocol

SLACK = 0.1
"""Seconds by which a result may come later than it was measured before its time is set anew."""

_FIRST, _LAST = -62_135_596_800.0, 253_402_300_799.0
"""The years 1 to 9999, in seconds since 1970."""


class Clock(Protocol):
    """The passing of time."""

    def time(self) -> float:
        """Return UTC in seconds since 1970; somebody may set it at any moment."""
        ...

    def monotonic(self) -> float:
        """Return seconds since some moment; nobody sets it."""
        ...

    def sleep(self, seconds: float, /) -> None:
        """Wait."""
        ...


class HostClock:
    """The clocks of this computer; the monotonic one goes on while it is suspended, where the system has such a one."""

    def time(self) -> float:
        """Return UTC in seconds since 1970."""
        return time.time()

    def monotonic(self) -> float:
        """Return seconds since some moment."""
        return time.clock_gettime(time.CLOCK_BOOTTIME) if hasattr(time, "CLOCK_BOOTTIME") else time.monotonic()

    def sleep(self, seconds: float, /) -> None:
        """Wait."""
        time.sleep(seconds)


class TimeBase:
    """The times of a session's samples.

    The host's clock is read once, at the beginning; after that, time goes on by the monotonic clock, whatever somebody
    does to the other one. Samples are as far apart as the board's sample rate says, from a beginning that is corrected
    by when results come: none comes before it was measured, and one that comes much later, or a board whose clock is
    slower than it says, moves the beginning on.

    Parameters
    ----------
    clock : Clock
        The clocks.
    rate : float
        Samples of a channel in a second.
    """

    def __init__(self, clock: Clock, rate: float) -> None:
        self._clock, self._rate = clock, rate
        self._offset = clock.time() - clock.monotonic()
        self._start: float | None = None  # of sample 0, on the monotonic clock

    @property
    def start(self) -> float:
        """Time of sample 0, in seconds since 1970, if all samples had been of this session."""
        assert self._start is not None, "a sample must have been seen"
        return self._offset + self._start

    def begin(self, sample: int) -> None:
        """Note that a sample is measured now."""
        self._start = self._clock.monotonic() - sample / self._rate

    def came(self, sample: int, moment: float) -> None:
        """Note that the newest result there was came at a moment of the monotonic clock."""
        latest, period = moment - sample / self._rate, 1 / self._rate
        if self._start is None or latest - self._start > period + SLACK:
            self._start = latest
        elif latest < self._start:  # by so little at once that every sample comes out behind the one before
            self._start = max(latest, self._start - period / 2)


def utc_text(seconds: float, digits: str = "microseconds") -> str:
    """Return a time in seconds since 1970 as text, such as 2026-01-31T12:00:00.000Z; it ends with the year 9999."""
    shown = datetime.fromtimestamp(min(max(seconds, _FIRST), _LAST), UTC)
    return shown.isoformat(timespec=digits).replace("+00:00", "Z")
