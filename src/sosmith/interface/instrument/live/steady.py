"""What a board with converters reads while nothing moves: the mean over a stated time, and how well it is known."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sosmith.host.board import Board, Results
from sosmith.host.clock import Clock, HostClock
from sosmith.model.errors import ShortfallError, SpecificationError

FEWEST = 16
"""Fewest results of a reading: fewer say too little of their scatter."""

HALVES = 40
"""Halves of a reading that are waited for until two in a row agree."""

APART = 3.0
"""Halves agree if their means differ by no more than so many standard uncertainties of the difference."""

SPOILT = ("fault", "input_at_rail", "output_saturated", "settling")
"""Flags of results that say nothing of what is before the sensor."""

_PAUSE = 0.05
"""Seconds between two requests for results while there are none."""

_AT_ONCE = 512
"""Most results that are fetched without a pause: a board keeps fewer."""

Values = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Mean:
    """The mean of consecutive results.

    Attributes
    ----------
    value, scatter, uncertainty : float
        Mean, standard deviation of a single result, and standard uncertainty of the mean, in the unit of the results.
    count : int
        Number of results.
    """

    value: float
    scatter: float
    uncertainty: float
    count: int


def mean_of(values: Values) -> Mean:
    """Return the mean of results that a filter may have correlated, shape (n,) with n of 2 or more.

    They count as n / tau independent ones; the autocorrelation time tau is the sum of the autocorrelations up to the
    first pair of them that is not positive (Geyer, Statist. Sci. 7, 1992, section 3.3), between 1 and n / 2.
    """
    n = len(values)
    scatter = float(np.std(values, ddof=1))
    if not scatter:
        return Mean(float(values[0]), 0.0, 0.0, n)
    spectrum = np.fft.rfft(values - values.mean(), 2 * n)
    correlation = np.fft.irfft(np.abs(spectrum) ** 2)[: n // 2 * 2]
    pairs = (correlation / correlation[0]).reshape(-1, 2).sum(axis=1)
    positive = pairs[: int(np.argmax(pairs <= 0))] if np.any(pairs <= 0) else pairs
    tau = min(max(2 * float(positive.sum()) - 1, 1.0), n / 2)
    return Mean(float(values.mean()), scatter, scatter * math.sqrt(tau / n), n)


def _level(values: Values) -> Values:
    """Return values without their linear trend, which would count as scatter: what moves must not seem to be noise."""
    steps = np.arange(len(values)) - (len(values) - 1) / 2
    return values - steps * float(steps @ values) / float(steps @ steps)


class SteadyReader:
    """Reads a channel of a board with converters, once it stands still.

    Parameters
    ----------
    board : Board
        The board.
    channel : int
        Its channel.
    clock : Clock or None
        Time; None for that of this computer.

    Raises
    ------
    SpecificationError
        If the board has no converters, or no such channel.
    """

    def __init__(self, board: Board, channel: int = 0, clock: Clock | None = None) -> None:
        about = board.identity
        if about.source != "converter":
            raise SpecificationError("the board must measure by itself, with converters, not be fed over the link")
        if not 0 <= channel < about.channels:
            raise SpecificationError(f"the channel must be 0 to {about.channels - 1}, not {channel}")
        self._board, self._channel, self._clock = board, channel, clock or HostClock()

    def read(
        self, seconds: float, tolerance: float, progress: Callable[[int, int], None] = lambda done, total: None
    ) -> Mean:
        """Return the mean over a time in which the result stands still, from now on.

        What the board has kept is dropped. Both halves of the time must agree within `tolerance`, in the unit of the
        results, or what the scatter of the later one explains, which a change in the first one must not excuse; else
        the first one is dropped and the next one waited for, so that a filter has the time to settle. So are halves in
        which a result has a flag of `SPOILT`.

        Parameters
        ----------
        seconds : float
            The time; at least that of 16 results.
        tolerance : float
            Largest difference of both halves.
        progress : callable
            Called with the number of results of the two halves so far, and their total.

        Raises
        ------
        ShortfallError
            If the result does not stand still.
        LinkError
            If the link fails.
        """
        size = max(math.ceil(seconds * self._board.identity.sample_rate / 2), FEWEST // 2)
        for _ in self._board.poll_all(_AT_ONCE):  # a board that is faster than the link always has more
            pass
        self._waiting: list[tuple[float, int]] = []
        before, reason = None, ""
        for _ in range(HALVES):
            first = 0 if before is None else size
            values, status = self._half(size, first, progress)
            flags = [name for name in SPOILT if status >> self._board.identity.flags.get(name, 8) & 1]
            if flags:
                before, reason = None, f"with the flag {flags[0]}"
                continue
            if before is not None:
                apart = values.mean() - before.mean()
                if abs(apart) <= max(tolerance, APART * math.sqrt(2) * mean_of(_level(values)).uncertainty):
                    return mean_of(np.concatenate([before, values]))
                reason = f"moving by {abs(apart):.3g} {self._board.identity.output_port.unit}".rstrip()
            before = values
        raise ShortfallError(f"the result must stand still for {seconds:g} s, not be {reason} after {HALVES} tries")

    def _half(self, size: int, first: int, progress: Callable[[int, int], None]) -> tuple[Values, int]:
        """Return the next results of the channel, behind `first` others, and all flags that one of them has."""
        while len(self._waiting) < size:
            progress(first + len(self._waiting), 2 * size)
            came = False
            for channel, results in self._board.poll_all(_AT_ONCE):
                came = True
                self._take(channel, results)
            if not came:
                self._clock.sleep(_PAUSE)
        taken, self._waiting = self._waiting[:size], self._waiting[size:]
        values = np.array([value for value, _ in taken])
        return values, int(np.bitwise_or.reduce([status for _, status in taken]))

    def _take(self, first: int, results: Results) -> None:
        """Keep the channel's results, of which some may have been overwritten in the board."""
        channels = self._board.identity.channels
        own = slice((self._channel - first) % channels, None, channels)
        self._waiting += zip(results.values[own].tolist(), results.status[own].tolist(), strict=True)
