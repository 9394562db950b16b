"""Sessions of the studio on a small filter, and waiting for what they come to know."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event
from typing import Any

from tests.interface.small import FILTER

import sosmith
from sosmith.studio.session import Session, opened

PATIENCE = 120.0
"""Seconds to wait for what must come."""

TEXT = sosmith.Specification.load(FILTER).toml().replace("cutoff = 100.0", "cutoff = 100.0  # of the sensor")


def file_in(folder: Path, text: str = TEXT) -> Path:
    """Write a specification."""
    path = folder / "plain.toml"
    path.write_text(text, encoding="utf-8")
    return path


@contextmanager
def session_in(folder: Path, text: str = TEXT) -> Iterator[Session]:
    """Open a session on a specification in `folder`."""
    scratch = folder / "scratch"
    scratch.mkdir()
    session = opened(file_in(folder, text), None, scratch)
    try:
        yield session
    finally:
        session.close()


def state(session: Session) -> dict[str, Any]:
    """Return everything that the session knows."""
    return session.wait(-1, Event())[1]


def until(session: Session, holds: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """Wait until something holds of what the session knows; return that."""
    end = time.monotonic() + PATIENCE
    while not holds(known := state(session)):
        assert time.monotonic() < end, f"it must come to hold, not {known}"
        time.sleep(0.01)
    return known


def proven(session: Session) -> dict[str, Any]:
    """Wait until the proof of the present text is done, and return what is known."""
    return until(session, lambda known: known["proof"]["state"] == "proven" and not session.busy)
