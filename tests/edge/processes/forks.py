"""Children of this process, which has everything loaded: forked, killed at any moment, and nothing left of them."""

from __future__ import annotations

import fcntl
import mmap
import os
import random
import signal
import sys
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

PATIENCE = 300.0
"""Seconds after which a child is taken to hang, on however busy a machine."""

_ROOM = 1 << 20
"""Bytes of what a child says."""

GONE = 30.0
"""Seconds that processes of a killed child have to end."""


class Ledger:
    """Whole numbers that outlive the child which wrote them: what it has been acknowledged. They begin with 0."""

    def __init__(self) -> None:
        self._numbers = memoryview(mmap.mmap(-1, mmap.PAGESIZE)).cast("q")

    def __getitem__(self, place: int) -> int:
        """Read a number."""
        return int(self._numbers[place])

    def __setitem__(self, place: int, value: int) -> None:
        """Write a number; it is there for everybody when this returns."""
        self._numbers[place] = value


@dataclass(frozen=True)
class Ended:
    """How a child ended.

    Attributes
    ----------
    status : int
        Its exit status; the signal's number, negative, if one ended it.
    said : str
        What it wrote to stdout and stderr.
    seconds : float
        How long it ran.
    peak : float
        Its most memory, in MB.
    """

    status: int
    said: str
    seconds: float
    peak: float


def forked(
    act: Callable[[], object], *, kill_after: float | None = None, once: Callable[[], bool] = lambda: True
) -> Ended:
    """Let a child do something, in a session of its own; kill it so many seconds after `once` is true, or if it hangs.

    An exception ends it with status 70, after its traceback, a `SystemExit` as it ends any process. What it has
    started must end with it.

    Raises
    ------
    AssertionError
        If something that it has started goes on.
    """
    reader, writer = os.pipe()
    fcntl.fcntl(writer, fcntl.F_SETPIPE_SZ, _ROOM)
    os.set_blocking(writer, False)  # what is too much is lost, and nobody waits
    begun = time.monotonic()
    pid = os.fork()
    if not pid:
        _run(act, writer)
    os.close(writer)
    while not (once() or _has_ended(pid)) and time.monotonic() < begun + PATIENCE:
        time.sleep(0.0005)
    ended = _waited_for(pid, begun + PATIENCE if kill_after is None else time.monotonic() + kill_after)
    seconds = time.monotonic() - begun
    end = time.monotonic() + GONE
    while running(pid):
        if time.monotonic() > end:
            os.killpg(pid, signal.SIGKILL)
            raise AssertionError("what a killed process has started must end with it")
        time.sleep(0.02)
    with os.fdopen(reader, "rb") as said:
        return Ended(ended[0], said.read().decode(errors="replace"), seconds, ended[1] / 1024)


def _run(act: Callable[[], object], told: int) -> None:
    """Be the child."""
    status = 70
    try:
        os.setsid()
        for number in (1, 2):
            os.dup2(told, number)
        os.close(told)
        sys.stdout = os.fdopen(os.dup(1), "w", encoding="utf-8")
        sys.stderr = sys.__stderr__ = os.fdopen(os.dup(2), "w", encoding="utf-8", buffering=1)
        act()
        status = 0
    except SystemExit as left:
        status = left.code if isinstance(left.code, int) else int(left.code is not None)
    except BaseException:
        traceback.print_exc()
    finally:
        with suppress(Exception):
            sys.stdout.flush()
        os._exit(status)


def _waited_for(pid: int, end: float) -> tuple[int, int]:
    """Wait for a child, or kill it at the end; return its exit status and its most memory in KB."""
    while True:
        found, status, used = os.wait4(pid, os.WNOHANG)
        if found:
            return os.waitstatus_to_exitcode(status), used.ru_maxrss
        left = end - time.monotonic()
        if left <= 0:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
            _, status, used = os.wait4(pid, 0)
            return os.waitstatus_to_exitcode(status), used.ru_maxrss
        time.sleep(min(left, 0.002))


def _has_ended(pid: int) -> bool:
    return os.waitid(os.P_PID, pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None


def running(session: int) -> list[int]:
    """List the processes of a session that are alive."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError, ValueError, IndexError):
            state, _, _, of_session = entry.read_text(encoding="utf-8").rpartition(")")[2].split()[:4]
            if int(of_session) == session and state not in "ZX":
                found.append(int(entry.parent.name))
    return found


def moment(rng: random.Random, longest: float) -> float:
    """Draw a moment at which a child is killed: as often early as late, and now and then when it has just ended."""
    return rng.uniform(0, 1.05 * longest)
