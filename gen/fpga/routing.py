"""Runs a placer whose first router may not come to an end, and then once more with the other one.

nextpnr's router1, which it takes for an iCE40, gives shorter paths than router2, but with long carry chains it
sometimes takes the same wires in turn for ever. It says after each thousand tries how many there were: where it has
tried many times as often as there are connections, it is stopped. The decision depends on these numbers alone, never on
the time, so that the same input gives the same bitstream.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

OTHER_ROUTER = ("--router", "router2")
"""Options of nextpnr for the router that comes to an end."""

_CONNECTIONS = re.compile(r"^Info: Routing (\d+) arcs", re.MULTILINE)
_TRIES = re.compile(r"^Info:\s+(\d+) \|", re.MULTILINE)
_MOST_TRIES = 20
"""Tries for each connection: those that come to an end take two or three."""

_FEWEST = 10_000
"""Tries that any design may take."""

_SECONDS = 0.5
"""Time between two looks at what the placer says."""

Start = Callable[[Sequence[str]], "subprocess.Popen[bytes]"]
"""Starts a placer with some arguments; what it says is appended to a log."""


def is_endless(said: str) -> bool:
    r"""Whether a router says that it has tried far more often than there are connections.

    >>> is_endless("Info: Routing 900 arcs.\nInfo:   19000 |   8960   12 | 900  2 | 3| 0.1 9.4|\n")
    True
    """
    connections, tries = (max(map(int, numbers.findall(said)), default=0) for numbers in (_CONNECTIONS, _TRIES))
    return tries > max(_MOST_TRIES * connections, _FEWEST)


def placed(start: Start, arguments: Sequence[str], log: Path) -> int:
    """Place and route; return the exit status.

    Parameters
    ----------
    start : callable
        Starts the placer.
    arguments : sequence of str
        Its arguments, without a choice of router.
    log : Path
        Where what it says goes.
    """
    before = log.stat().st_size if log.exists() else 0

    def endless() -> bool:
        return is_endless(log.read_bytes()[before:].decode(errors="replace"))

    with start(arguments) as process:
        status = waited(process, endless)
    if not endless():
        return status
    with log.open("ab") as output:
        output.write(b"The first router has tried too often for these connections; the second one takes over.\n")
    with start([*arguments, *OTHER_ROUTER]) as process:
        return waited(process)


def waited(process: subprocess.Popen[bytes], stop: Callable[[], bool] = lambda: False) -> int:
    """Wait for a program, which ends with whatever ends the wait, and is stopped if `stop` says so."""
    try:
        while True:
            try:
                return process.wait(_SECONDS)
            except subprocess.TimeoutExpired:
                if stop():
                    process.kill()
    except BaseException:
        process.kill()
        raise
