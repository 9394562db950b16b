"""The integer model of a core behind the bytes of the link."""

from __future__ import annotations

import numpy as np

from sosmith.model.dataflow.compiled import Pushed, compile_block
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.link.packing import bytes_of, codes_of


class _NoRegisters:
    """A core without registers."""

    def read(self, address: int) -> int | None:
        """Refuse: there are no registers."""
        return None

    def write(self, address: int, word: int) -> bool:
        """Refuse: there are no registers."""
        return False


class IntegerCore(_NoRegisters):
    """A datapath with the states of its channels, fed with samples as they are on an AXI4-Stream.

    It has no registers.

    Parameters
    ----------
    datapath : Datapath
        What it computes.
    channels : int
        Number of channels.

    Raises
    ------
    ToolError
        If no C compiler is found.
    """

    def __init__(self, datapath: Datapath, channels: int = 1) -> None:
        self._datapath, self._channels = datapath, channels
        self._block = compile_block(datapath)
        self._states = self._block.reset(channels)

    def reset(self) -> None:
        """Clear the states of all channels."""
        self._states = self._block.reset(self._channels)

    def feed(self, channel: int, samples: bytes) -> bytes:
        """Return the results of samples, the first of `channel` and the others of those that follow in turn."""
        codes = codes_of(samples, self._datapath.inputs)
        rows = -(-(channel + len(codes)) // self._channels)
        own = slice(channel, channel + len(codes))
        block = np.zeros((rows * self._channels, codes.shape[1]), dtype=np.int64)
        block[own] = codes
        present = np.zeros(rows * self._channels, dtype=bool)
        present[own] = True
        turns, taken = block.reshape(rows, self._channels, codes.shape[1]), present.reshape(rows, self._channels)
        results, status = np.zeros((2, rows, self._channels), dtype=np.int64)
        # Only in the first and the last turn may channels be absent; their states stay.
        for part in (slice(0, 1), slice(1, max(rows - 1, 1)), slice(max(rows - 1, 1), rows)):
            if len(turns[part]):
                before = self._states.copy()
                results[part], status[part] = self._block(turns[part], with_status=True, states=self._states)
                absent = ~taken[part][0]
                self._states[absent] = before[absent]
        columns = np.stack([results.reshape(-1)[own], status.reshape(-1)[own]], axis=1)
        return bytes_of(columns, [self._datapath.output.bytes, 1])


class HeldCore(_NoRegisters):
    """A datapath with a decimator, each of whose results is handed out once for each of its samples.

    Result n of a channel is copy ``n % R`` of the result that its sample ``n - n % R`` has brought, and so is there as
    soon as sample n is in. It has no registers.

    Parameters
    ----------
    datapath : Datapath
        What it computes.
    channels : int
        Number of channels.

    Raises
    ------
    ToolError
        If no C compiler is found.
    """

    def __init__(self, datapath: Datapath, channels: int = 1) -> None:
        self._datapath = datapath
        self._push = [Pushed(datapath) for _ in range(channels)]
        self._held = [(0, 0)] * channels

    def reset(self) -> None:
        """Return to the state after reset."""
        for push in self._push:
            push.reset()

    def feed(self, channel: int, samples: bytes) -> bytes:
        """Return a result for each sample, the first of `channel` and the others of those that follow in turn."""
        rows = []
        for n, codes in enumerate(codes_of(samples, self._datapath.inputs), channel):
            own = n % len(self._push)
            self._held[own] = self._push[own](codes) or self._held[own]
            rows.append(self._held[own])
        return bytes_of(np.array(rows, dtype=np.int64).reshape(-1, 2), [self._datapath.output.bytes, 1])
