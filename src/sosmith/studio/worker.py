"""A process that carries out jobs, one after another, and ends with its parent whatever happens.

It is forked from multiprocessing's fork server, which has loaded all that jobs need: a new one is there in
hundredths of a second.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import sys
import threading
from functools import partial
from multiprocessing.connection import Connection
from types import FrameType
from typing import Any

from sosmith import SosmithError

PRELOADED = ["sosmith.studio.jobs", "pydantic"]
"""What the fork server loads; the last one is what the first specification would load."""


def work(connection: Connection) -> None:
    """Carry out jobs until the connection is closed.

    A job comes as its number, the name of a function in `sosmith.studio.jobs` and its arguments by name. Sent back are
    the number, a kind and a value: any number of times ``"step"`` or ``"part"``, once ``"result"`` or ``"refused"``.
    """
    from sosmith.studio import jobs

    gc.freeze()  # what the fork server has loaded is there to stay
    gc.set_threshold(50_000, 20, 20)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which ends its workers
    signal.signal(signal.SIGTERM, _leave)  # so that a simulator is ended as well
    parent = multiprocessing.parent_process()
    assert parent is not None
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()

    def say(*message: Any) -> None:
        try:
            connection.send(message)
        except OSError:
            sys.exit()  # there is nobody any more

    while True:
        try:
            number, name, arguments = connection.recv()
        except (EOFError, OSError):
            return
        try:
            say(number, "result", getattr(jobs, name)(partial(say, number), **arguments))
        except SosmithError as error:
            say(number, "refused", str(error))


def _leave(number: int, frame: FrameType | None) -> None:
    sys.exit(128 + number)


def _end_with(parent: multiprocessing.process.BaseProcess) -> None:
    """End with the parent, in the middle of a job too: first in order, which ends a simulator, then at once."""
    parent.join()
    os.kill(os.getpid(), signal.SIGTERM)
    threading.Event().wait(5)
    os._exit(1)
