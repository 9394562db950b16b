"""What is known of a board at this moment: the newest reading of each channel, and the past, thinned out evenly."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sosmith.host.alarms import Alarm
from sosmith.host.board import Results
from sosmith.model.link.identity import Identity

POINTS = 2000
"""Most points of a channel that are kept; when there are more, every second one is left out."""

ALARMS = 50
"""Alarms that are kept to be shown; all are counted."""


@dataclass(frozen=True)
class Reading:
    """The newest result of a channel.

    Attributes
    ----------
    channel : int
        The channel.
    value : float
        The result, in the unit of the output.
    wear : float or None
        The result minus that without wear; None if the specification has no ``[wear]``.
    per_hour : float or None
        Least-squares slope of all that is kept, per hour; None for fewer than three points.
    flags : tuple of str
        Names of the flags that are raised.
    """

    channel: int
    value: float
    wear: float | None
    per_hour: float | None
    flags: tuple[str, ...]


class History:
    """Results of a channel with their sample numbers, thinned out evenly as they become many.

    A flag of a result that is left out moves to the next one that is kept, so that none is lost.

    Attributes
    ----------
    numbers : ndarray of int
        Numbers of the samples.
    values : ndarray of float
        Their results.
    status : ndarray of uint8
        Their flags.
    """

    def __init__(self) -> None:
        self.numbers: npt.NDArray[np.int64] = np.empty(0, dtype=np.int64)
        self.values: npt.NDArray[np.float64] = np.empty(0, dtype=np.float64)
        self.status: npt.NDArray[np.uint8] = np.empty(0, dtype=np.uint8)
        self._step = 1
        self._pending = 0

    def add(self, first: int, values: npt.NDArray[np.float64], status: npt.NDArray[np.uint8]) -> None:
        """Take consecutive results, the first of sample number `first`."""
        self._take(np.arange(first, first + len(values)), values, status)
        while len(self.numbers) > POINTS:
            self._step *= 2
            numbers, values, status = self.numbers, self.values, self.status
            self.numbers, self.values, self.status = numbers[:0], values[:0], status[:0]
            pending, self._pending = self._pending, 0
            self._take(numbers, values, status)
            self._pending |= pending

    def thinned(self, points: int) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64], npt.NDArray[np.uint8]]:
        """Return numbers, values and flags of at most as many points, with the newest one among them."""
        edges = np.unique(np.linspace(0, len(self.numbers), points + 1).astype(int))
        if len(edges) < 2:
            return self.numbers, self.values, self.status
        last = edges[1:] - 1
        return self.numbers[last], self.values[last], np.bitwise_or.reduceat(self.status, edges[:-1])

    def slope(self) -> float | None:
        """Return the least-squares slope per sample; None for fewer than three points."""
        if len(self.values) < 3:
            return None
        x = self.numbers - self.numbers.mean()
        return float(x @ (self.values - self.values.mean()) / (x @ x))

    def _take(
        self, numbers: npt.NDArray[np.int64], values: npt.NDArray[np.float64], status: npt.NDArray[np.uint8]
    ) -> None:
        kept = np.flatnonzero(numbers % self._step == 0)
        if not len(kept):
            self._pending |= int(np.bitwise_or.reduce(status))
            return
        collected = status.copy()
        collected[0] |= self._pending
        starts = np.concatenate([[0], kept[:-1] + 1])
        self.numbers = np.concatenate([self.numbers, numbers[kept]])
        self.values = np.concatenate([self.values, values[kept]])
        self.status = np.concatenate([self.status, np.bitwise_or.reduceat(collected[: kept[-1] + 1], starts)])
        self._pending = int(np.bitwise_or.reduce(collected[kept[-1] + 1 :]))


class Readings:
    """Everything that a view of a board shows.

    Parameters
    ----------
    identity : Identity
        The board.
    manifest : mapping or None
        The core's manifest, which tells the limits of wear; None if there is none.
    port : str
        Where the board is.

    Attributes
    ----------
    state : str
        ``connected`` or ``lost``.
    alarms : int
        Alarms so far.
    newest_alarms : deque of Alarm
        The last ones of them.
    samples : int
        Samples of a channel so far.
    utc : float
        Time of the newest sample, in seconds since 1970.
    histories : tuple of History
        The past of each channel.
    initial : tuple of float or None
        Result of each channel without wear; None if the specification has no ``[wear]``.
    rated : bool
        Whether its change per hour is shown: that of a measured quantity, not of a plain filter's output.
    limits : dict of str to float
        Wear at which to warn and at which it is critical, by ``warning`` and ``critical``; empty without ``[wear]``.
    """

    def __init__(self, identity: Identity, manifest: Mapping[str, Any] | None, port: str) -> None:
        self.identity, self.port = identity, port
        self.state, self.alarms, self.samples = "connected", 0, 0
        self.utc = 0.0
        self.newest_alarms: deque[Alarm] = deque(maxlen=ALARMS)
        self.histories = tuple(History() for _ in range(identity.channels))
        wear = (manifest or {}).get("spec", {}).get("wear")
        self.initial = _initial(wear, identity.channels) if wear else None
        self.rated = identity.core != "filter" or self.initial is not None
        self.limits = {
            name: float(wear[key])
            for name, key in (("warning", "warning"), ("critical", "limit"))
            if wear and wear.get(key) is not None
        }

    def add(self, results: Results, first: int, start: float = 0.0) -> None:
        """Take the newest results, the first of sample number `first`; sample 0 was at `start`, in s since 1970."""
        shape = (-1, self.identity.channels)
        values, status = results.values.reshape(shape), results.status.reshape(shape)
        for channel, history in enumerate(self.histories):
            history.add(first, values[:, channel], status[:, channel])
        self._last = list(zip(values[-1].tolist(), status[-1].tolist(), strict=True))
        self.samples = first + len(values)
        self.utc = start + (self.samples - 1) / self.identity.result_rate

    def alarm(self, one: Alarm) -> None:
        """Take an alarm."""
        self.alarms += 1
        self.newest_alarms.append(one)

    @property
    def seconds(self) -> float:
        """Time that the samples so far have taken, in s."""
        return self.samples / self.identity.result_rate

    @property
    def now(self) -> list[Reading]:
        """The newest reading of each channel; none before the first result."""
        if not self.samples:
            return []
        readings = []
        for channel, (value, status) in enumerate(self._last):
            slope = self.histories[channel].slope()
            readings.append(
                Reading(
                    channel=channel,
                    value=value,
                    wear=None if self.initial is None else value - self.initial[channel],
                    per_hour=None if slope is None else slope * self.identity.result_rate * 3600,
                    flags=self.flags_of(status),
                )
            )
        return readings

    def flags_of(self, status: int) -> tuple[str, ...]:
        """Return the names of the flags in a status."""
        return tuple(flag for flag, bit in self.identity.flags.items() if status >> bit & 1)


def _initial(wear: Mapping[str, Any], channels: int) -> tuple[float, ...]:
    """Clearance of each channel without wear, from the specification in the manifest."""
    given = wear["initial"]
    return tuple(map(float, given)) if isinstance(given, list) else (float(given),) * channels
