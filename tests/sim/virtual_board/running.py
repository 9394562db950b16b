"""A board in Verilator behind a pseudo-terminal, with damage on its line or without."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from sosmith.sim.virtual_board.netlist import Damage, Netlist, forward
from sosmith.sim.virtual_board.terminal import Terminal


@contextmanager
def running(netlist: Netlist, damage: Damage | None = None) -> Iterator[str]:
    """Run a board behind a pseudo-terminal; give its path."""
    with Terminal() as terminal:
        if damage is None:
            with netlist.at(terminal.end):
                yield terminal.path
            return
        ours, theirs = socket.socketpair()
        stop = threading.Event()
        with ours, netlist.at(theirs.fileno()):
            theirs.close()
            between = threading.Thread(target=forward, args=(terminal.end, ours, damage, lambda: not stop.is_set()))
            between.start()
            try:
                yield terminal.path
            finally:
                stop.set()
                between.join()
