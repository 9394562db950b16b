"""A lane: one process that does one job at a time, and that a new job puts an end to when it is still busy."""

from __future__ import annotations

import multiprocessing
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerProcess
from typing import Any

from sosmith.studio.worker import PRELOADED, work

PATIENCE = 30.0
"""Seconds that a process has to end in order, which takes hundredths of one; killed, it could not end its simulator."""

News = Callable[[str, Any], None]
"""Told what a job says: a kind, which is one of those in `sosmith.studio.worker.work` or ``"died"``, and its value."""


def warm_up() -> None:
    """Have the fork server load what jobs need, in the background."""
    from multiprocessing import forkserver

    multiprocessing.get_context("forkserver").set_forkserver_preload(PRELOADED)
    forkserver.ensure_running()


class Lane:
    """Does one job at a time, in a process of its own.

    A process is kept for the next job when it is idle, and ended when it is busy. What a job says after it was
    superseded is dropped.

    Parameters
    ----------
    lock : RLock
        Held while news are sent, and expected to be held by the caller: what is sent is never out of date.
    """

    def __init__(self, lock: threading.RLock) -> None:
        self._lock = lock
        self._worker: _Worker | None = None
        self._number = 0
        self._news: News | None = None
        self._closed = False

    @property
    def busy(self) -> bool:
        """Whether a job is being done."""
        return self._news is not None

    @property
    def processes(self) -> list[int]:
        """Ids of the processes that there are: none or one."""
        with self._lock:
            return [] if self._worker is None else [self._worker.id]

    def run(self, news: News, job: str, **arguments: Any) -> None:
        """Begin a job, the name of a function in `sosmith.studio.jobs`; a busy process is ended first."""
        with self._lock:
            self.cancel()
            if self._closed:
                return
            if self._worker is None:
                self._worker = _Worker.started()
                threading.Thread(target=self._listen, args=(self._worker,), daemon=True).start()
            self._number, self._news = self._number + 1, news
            self._worker.send((self._number, job, arguments))

    def cancel(self) -> None:
        """Put an end to the job, if there is one, and wait until its process is gone."""
        with self._lock:
            self._number += 1
            if self._news is not None:
                self._news = None
                self._drop()

    def close(self) -> None:
        """End the process; no job begins after this."""
        with self._lock:
            self._closed, self._news = True, None
            self._drop()

    def _drop(self) -> None:
        worker, self._worker = self._worker, None
        if worker is not None:
            worker.end()

    def _listen(self, worker: _Worker) -> None:
        """Pass on what a process says, as long as it is ours."""
        while True:
            message = worker.receive()
            with self._lock:
                if self._worker is not worker:
                    return
                number, kind, value = message or (self._number, "died", None)
                news = self._news if number == self._number else None
                if kind == "died":
                    self._drop()
                if news is not None:
                    if kind in {"result", "refused", "died"}:
                        self._news = None
                    news(kind, value)
            if kind == "died":
                return


@dataclass(frozen=True, eq=False)
class _Worker:
    """A process and the connection to it."""

    process: ForkServerProcess
    connection: Connection
    id: int

    @classmethod
    def started(cls) -> _Worker:
        context = multiprocessing.get_context("forkserver")
        ours, theirs = context.Pipe()
        process = context.Process(target=work, args=(theirs,), daemon=True)
        process.start()
        theirs.close()
        assert process.pid is not None
        return cls(process, ours, process.pid)

    def send(self, message: tuple[int, str, dict[str, Any]]) -> None:
        with suppress(OSError):  # it has died, of which the listener learns
            self.connection.send(message)

    def receive(self) -> tuple[int, str, Any] | None:
        """Return the next message; None if there will be none."""
        try:
            message: tuple[int, str, Any] = self.connection.recv()
        except (EOFError, OSError):
            return None
        return message

    def end(self) -> None:
        self.process.terminate()
        self.process.join(PATIENCE)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
