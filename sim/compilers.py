"""Compilers that run side by side, and end with what started them.

A process that is told to end waits for its threads, and these for their compilers: up to 20 s.
"""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Lock
from typing import IO


class Compilers:
    """The compilers that are running.

    Parameters
    ----------
    environment : mapping of str to str
        Environment that they need.
    log : file or None
        Where their output goes; None for that of this process.
    alone : bool
        Whether a signal may reach this process alone. If not, its whole process group is killed, and they stay in it.
    """

    def __init__(self, environment: Mapping[str, str], log: IO[str] | None, *, alone: bool) -> None:
        self._environment, self._log, self._alone = environment, log, alone
        self._lock = Lock()
        self._running: set[subprocess.Popen[bytes]] = set()
        self._ended = False

    def run(self, command: Sequence[str], folder: Path) -> None:
        """Run one in `folder`, which also takes its temporary files: those of one that was killed stay.

        Raises
        ------
        subprocess.CalledProcessError
            If it fails or was ended.
        """
        with self._lock:
            if self._ended:
                raise subprocess.CalledProcessError(-signal.SIGKILL, command)
            process = subprocess.Popen(
                command,
                cwd=folder,
                env={**self._environment, "TMPDIR": str(folder)},
                stdin=subprocess.DEVNULL,
                stdout=self._log,
                stderr=self._log,
                process_group=0 if self._alone else None,
            )
            self._running.add(process)
        try:
            status = process.wait()
        finally:
            self._kill(process)
            self._running.discard(process)
        if status:
            raise subprocess.CalledProcessError(status, command)

    @contextmanager
    def ended_at_once(self) -> Iterator[None]:
        """End those that other threads run when an exception, such as Ctrl-C, leaves the context."""
        try:
            yield
        except BaseException:
            with self._lock:
                self._ended = True
                for process in [*self._running]:  # other threads take out of it what has ended
                    self._kill(process)
            raise

    def _kill(self, process: subprocess.Popen[bytes]) -> None:
        """Kill one unless it has ended: as a group with what it started, where it has one."""
        if process.returncode is None:
            with suppress(ProcessLookupError):
                (os.killpg if self._alone else os.kill)(process.pid, signal.SIGKILL)
