"""A pseudo-terminal: the port of a virtual board."""

from __future__ import annotations

import os
import tty
from types import TracebackType


class Terminal:
    """A pseudo-terminal that passes every byte as it is; a ``with`` statement removes it.

    Attributes
    ----------
    path : str
        The port that a host opens.
    end : int
        File descriptor of the board's end.
    """

    def __init__(self) -> None:
        self.end, self._other = os.openpty()
        # This end stays open, so that the board need not care whether a host has the port open.
        tty.setraw(self._other)
        self.path = os.ttyname(self._other)

    def __enter__(self) -> Terminal:
        """Return the terminal."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove the terminal; for a host this is a port that was unplugged."""
        os.close(self.end)
        os.close(self._other)
