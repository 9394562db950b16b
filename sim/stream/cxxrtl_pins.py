"""The pins of a core in CXXRTL's model, which is loaded into this process as a library."""

from __future__ import annotations

import ctypes
from collections.abc import Coroutine
from itertools import count
from pathlib import Path
from typing import Any, TypeVar

from sosmith.sim.stream.pins import PERIOD_NS, SETTLE_NS

_Result = TypeVar("_Result")


class CxxrtlPins:
    """The pins of a core that simulates on the spot, so that awaiting it needs no event loop: see `finished`.

    Parameters
    ----------
    library : Path
        From `sosmith.sim.cxxrtl_model`. A process has one core of each library.
    waves : Path or None
        Where to write a waveform, if the library can.
    """

    def __init__(self, library: Path, waves: Path | None = None) -> None:
        self.library = ctypes.CDLL(str(library))
        self.library.sosmith_width.argtypes = (ctypes.c_char_p,)
        self.library.sosmith_width.restype = ctypes.c_uint64
        self.library.sosmith_read.argtypes = (ctypes.c_char_p, ctypes.c_uint64)
        self.library.sosmith_read.restype = ctypes.c_uint64
        self.library.sosmith_write.argtypes = (ctypes.c_char_p, ctypes.c_uint64, ctypes.c_uint64)
        self._words: dict[str, int] = {}
        self.library.sosmith_settle.argtypes = (ctypes.c_bool, ctypes.c_uint64)
        self._now = 0  # ns; the clock falls at multiples of its period
        if waves is not None:
            self.library.sosmith_open_waves(str(waves).encode())
        self._settle(clock=False)

    def read(self, port: str) -> int:
        """Value of a port; a model of bits has no X or Z."""
        name = port.encode()
        return sum(int(self.library.sosmith_read(name, k)) << 64 * k for k in range(self._count(port)))

    def write(self, port: str, value: int) -> None:
        """Set an input."""
        for k in range(self._count(port)):
            self.library.sosmith_write(port.encode(), k, value >> 64 * k & (1 << 64) - 1)

    def _count(self, port: str) -> int:
        """Words of 64 bits that a port has."""
        if port not in self._words:
            self._words[port] = -(-int(self.library.sosmith_width(port.encode())) // 64)
        return self._words[port]

    async def clock(self) -> None:
        """Go on to the next falling edge."""
        self._settle(clock=False)
        self._rise()
        self._fall()

    async def settle(self) -> None:
        """Let everything follow the inputs."""
        self._now += SETTLE_NS
        self._settle(clock=False)

    async def busy(self, limit: int) -> int:
        """Clock until the core accepts or offers something."""
        deadline = self._now + limit * PERIOD_NS
        self._settle(clock=False)
        for clocks in count(1):
            woken = self._has_news()
            self._rise()
            woken = woken or self._has_news()
            self._fall()
            if woken or self._now >= deadline:
                return clocks
        raise AssertionError

    def _has_news(self) -> bool:
        return bool(self.read("s_axis_tready") or self.read("m_axis_tvalid"))

    def _rise(self) -> None:
        self._now += PERIOD_NS // 2 - self._now % PERIOD_NS
        self._settle(clock=True)

    def _fall(self) -> None:
        self._now += PERIOD_NS // 2
        self._settle(clock=False)

    def _settle(self, *, clock: bool) -> None:
        self.library.sosmith_settle(clock, self._now)


def finished(run: Coroutine[Any, Any, _Result]) -> _Result:
    """Run to the end what awaits nothing but `CxxrtlPins`; return its result."""
    try:
        run.send(None)
    except StopIteration as end:
        result: _Result = end.value
        return result
    raise RuntimeError("a coroutine on CXXRTL's pins must await nothing else")
