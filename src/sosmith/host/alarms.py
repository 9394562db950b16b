"""Alarms: flags of results that must not rise unnoticed, with a command that is run for each."""

from __future__ import annotations

import os
import shlex
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sosmith.host.board import Results
from sosmith.model.errors import SpecificationError, ToolError
from sosmith.model.suggestion import did_you_mean

ALARMS = ("wear_critical", "fault")
"""Flags that are alarms unless others are named."""


@dataclass(frozen=True)
class Alarm:
    """A flag that has risen.

    Attributes
    ----------
    flag : str
        Its name.
    channel : int
        The channel.
    sample : int
        Number of the sample.
    value : float
        The result, in the unit of the output.
    utc : float
        Time of the sample, in seconds since 1970.
    """

    flag: str
    channel: int
    sample: int
    value: float
    utc: float


class Alarms:
    """Finds each rise of a flag, in each channel.

    Parameters
    ----------
    flags : sequence of str
        Names of the flags.
    known : dict of str to int
        Bits of all flags of the board.
    rate : float
        Samples of a channel in a second.

    Raises
    ------
    SpecificationError
        If the board has no such flag.
    """

    def __init__(self, flags: Sequence[str], known: dict[str, int], rate: float) -> None:
        for flag in flags:
            if flag not in known:
                hint = did_you_mean(flag, known)
                raise SpecificationError(f"an alarm must be one of {', '.join(known)}, not {flag}{hint}")
        self._flags, self._rate = tuple(flags), rate
        self._raised: dict[str, npt.NDArray[np.bool_]] = {}

    def rises(self, results: Results, first: int, start: float) -> list[Alarm]:
        """Return the rises in results, the first of which is of sample number `first`; sample 0 was at `start`."""
        rises = []
        values = results.values.reshape(len(results.values), -1)
        for flag in self._flags:
            now = results.flag(flag).reshape(values.shape)
            last = self._raised.get(flag, np.zeros(values.shape[1], dtype=np.bool_))
            before = np.concatenate([last[np.newaxis], now[:-1]])
            self._raised[flag] = now[-1]
            for n, channel in np.argwhere(now & ~before).tolist():
                rises.append(self._alarm(flag, channel, first + n, float(values[n, channel]), start))
        return sorted(rises, key=lambda alarm: (alarm.sample, alarm.channel))

    def _alarm(self, flag: str, channel: int, sample: int, value: float, start: float) -> Alarm:
        return Alarm(flag, channel, sample, value, start + sample / self._rate)


class Hook:
    """A command that is run for each alarm, with what it needs to know in its environment; none waits for another.

    The variables are SOSMITH_FLAG, SOSMITH_CHANNEL, SOSMITH_SAMPLE, SOSMITH_VALUE and SOSMITH_UNIT.

    Parameters
    ----------
    command : str
        The command with its arguments, as a shell would take them apart; no shell runs it.
    unit : str
        Unit of the values.
    """

    def __init__(self, command: str, unit: str) -> None:
        self._command, self._unit = shlex.split(command), unit
        self._running: list[subprocess.Popen[bytes]] = []

    def run(self, alarm: Alarm) -> None:
        """Start the command.

        Raises
        ------
        ToolError
            If it cannot be started.
        """
        variables = {
            "SOSMITH_FLAG": alarm.flag,
            "SOSMITH_CHANNEL": str(alarm.channel),
            "SOSMITH_SAMPLE": str(alarm.sample),
            "SOSMITH_VALUE": repr(alarm.value),
            "SOSMITH_UNIT": self._unit,
        }
        self._running = [process for process in self._running if process.poll() is None]
        try:
            process = subprocess.Popen(
                self._command, env=os.environ | variables, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL
            )
        except OSError as error:
            raise ToolError(
                f"the hook must be a command that can be run, not {self._command[0]}: {error.strerror}"
            ) from None
        self._running.append(process)

    def finish(self) -> None:
        """Wait for the commands that still run, 10 seconds at most for each."""
        for process in self._running:
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
