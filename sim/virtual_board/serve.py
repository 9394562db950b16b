"""Serves the model of a board at a pseudo-terminal."""

from __future__ import annotations

import os
import select
from collections.abc import Callable

from sosmith.model.link.device import Device

_ROOM = 1 << 16
_TURN = 0.03  # seconds


def serve(
    device: Device,
    end: int,
    *,
    damage: Callable[[bytes], bytes] = lambda data: data,
    goes_on: Callable[[], bool] = lambda: True,
) -> None:
    """Answer what arrives at a pseudo-terminal, until told to stop.

    Parameters
    ----------
    device : Device
        The model of the board.
    end : int
        File descriptor of the board's end.
    damage : callable
        Applied to the bytes in both directions.
    goes_on : callable
        Asked many times a second whether to go on.
    """
    while goes_on():
        ready, _, _ = select.select([end], [], [], _TURN)
        if ready:
            answer = damage(device.feed(damage(os.read(end, _ROOM))))
            while answer and goes_on():
                _, free, _ = select.select([], [end], [], _TURN)
                if free:
                    answer = answer[os.write(end, answer[:1024]) :]
