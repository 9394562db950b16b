"""What the bench needs of a simulator: the values of a core's ports, and the clock."""

from __future__ import annotations

import ctypes
from typing import Protocol

PERIOD_NS = 20
SETTLE_NS = 1
"""Time that signals get to settle within a clock; several of these fit into half a period."""


class Pins(Protocol):
    """The ports of a simulated core, whose clock ``aclk`` is low first."""

    def read(self, port: str) -> int | str:
        """Value of a port, unsigned; its bits as text if any is X or Z."""
        ...

    def write(self, port: str, value: int) -> None:
        """Set an input; what depends on it follows with the next wait."""
        ...

    async def clock(self) -> None:
        """Wait for the next falling edge of the clock."""
        ...

    async def settle(self) -> None:
        """Wait until everything has followed the inputs, for `SETTLE_NS`."""
        ...

    async def busy(self, limit: int) -> int:
        """Wait for the falling edge after ``s_axis_tready`` or ``m_axis_tvalid`` rises, or after `limit` periods.

        Returns
        -------
        int
            The clocks that have passed.
        """
        ...

    @property
    def library(self) -> ctypes.CDLL:
        """Where the compiled loop is, if the model has it."""
        ...
