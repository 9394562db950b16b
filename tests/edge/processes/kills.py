"""Kills at random moments of everything that writes: what is left is whole, and what was acknowledged is there."""

from __future__ import annotations

import random
import signal
import tempfile
from dataclasses import dataclass
from pathlib import Path

from tests.edge.processes.forks import Ledger, forked, moment
from tests.edge.processes.writers import Writer


@dataclass(frozen=True)
class Killed:
    """What became of a child that was killed.

    Attributes
    ----------
    at_work : bool
        Whether the kill met it before its end.
    findings : tuple of str
        What must not be.
    """

    at_work: bool
    findings: tuple[str, ...]


def killed(writer: Writer, seed: int, longest: float) -> Killed:
    """Let a child write, kill it at a moment drawn by the seed within `longest` seconds, and look at what is left.

    For odd seeds the seconds begin when the first thing is acknowledged, for even ones with the child.
    """
    with tempfile.TemporaryDirectory() as scratch:
        folder, done = Path(scratch), Ledger()
        writer.prepare(folder)
        after = moment(random.Random(seed), longest)
        try:
            once = (lambda: done[0] > 0) if seed % 2 and writer.longest is not None else (lambda: True)
            ended = forked(lambda: writer.write(folder, done), kill_after=after, once=once)
            findings = tuple(writer.faults(folder, done))
        except Exception as error:
            return Killed(at_work=True, findings=(f"{type(error).__name__}: {error}",))
        if ended.status not in {0, -signal.SIGKILL}:
            findings += (f"before the kill: {ended.said[-300:]}",)
        return Killed(ended.status == -signal.SIGKILL, findings)


def duration(writer: Writer) -> float:
    """Return the seconds within which a writer is to be killed: what it states, or those of a run to its end."""
    if writer.longest is not None:
        return writer.longest
    with tempfile.TemporaryDirectory() as scratch:
        folder, done = Path(scratch), Ledger()
        writer.prepare(folder)
        ended = forked(lambda: writer.write(folder, done))
        assert ended.status == 0, ended.said
        return ended.seconds
