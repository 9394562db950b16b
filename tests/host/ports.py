"""Ports for the tests: the model of a board behind a pseudo-terminal, in a thread, which can be unplugged."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from sosmith.model.link.device import Device
from sosmith.sim.virtual_board.serve import serve
from sosmith.sim.virtual_board.terminal import Terminal


@contextmanager
def plugged(
    device: Device, link: Path | None = None, damage: Callable[[bytes], bytes] = lambda data: data
) -> Iterator[str]:
    """Serve a board at a port while the context lasts; give its path, or that of a link to it, as a USB stick has."""
    stop = threading.Event()
    with Terminal() as terminal:
        server = threading.Thread(
            target=serve, args=(device, terminal.end), kwargs={"damage": damage, "goes_on": lambda: not stop.is_set()}
        )
        server.start()
        try:
            if link is not None:
                link.symlink_to(terminal.path)
            yield terminal.path if link is None else str(link)
        finally:
            if link is not None:
                link.unlink()
            stop.set()
            server.join()
