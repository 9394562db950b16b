"""Messages on their way to a broker: each with a number of its own, until the broker has acknowledged just that one."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sosmith.host.recording import check_output
from sosmith.model.errors import SpecificationError, ToolError

MOST = 100_000
"""Messages that wait at most; those that come when there are as many are left out, and counted."""

WINDOW = 20
"""Messages that must not be lost which the client has at once; the others wait here."""

SPAN = 30_000
"""Messages that may be handed over while an older one is not acknowledged: fewer than the client's numbers, which are
16 bits wide, so that no two messages under way have the same number."""

_APPLICATION = 0x50505354
"""What marks a database as an outbox of this program."""

Hand = Callable[[str, str, bool], int]
"""Gives topic, text and whether it is retained to the client; returns the client's number of it."""


@dataclass(frozen=True)
class _UnderWay:
    """A message that the client has: how many were handed over before it, and its number if it must not be lost."""

    place: int
    topic: str
    number: int | None


class Outbox:
    """Messages that wait for a broker, of two kinds.

    What is *put* must not be lost: it is handed to the client in order, `WINDOW` at a time, and is kept until the
    client says that the broker has acknowledged it. When `MOST` wait, what comes is left out and counted: the oldest
    tell how it began. What is *shown* is a state, of which only the newest one of a topic counts.

    The client's own numbers of messages wrap around; here, they are used only for messages that are under way, and no
    two of these have the same.

    Parameters
    ----------
    path : Path or None
        File that keeps the messages over restarts and kills; None for the memory of this process.

    Attributes
    ----------
    left_out : int
        Messages that were left out.

    Raises
    ------
    SpecificationError
        If the file is none of an outbox, or in use by another process.
    ToolError
        If the file does not take what is to be written.
    """

    def __init__(self, path: Path | None = None) -> None:
        self.left_out = 0
        self._path = path
        if path is not None:
            check_output(path)
            if not path.parent.is_dir():
                raise SpecificationError(f"{path}: the file of waiting messages must be in a folder that is there")
        self._kept = sqlite3.connect(path or ":memory:", timeout=0, isolation_level=None)
        try:
            self._open()
        except sqlite3.Error as error:
            self._kept.close()
            code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR)
            if code & 0xFF in {sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR}:  # above these bits are details
                raise self._full(error) from None
            reason = "in use by another process" if "locked" in str(error) else str(error)
            raise SpecificationError(f"{path}: the file must be one of waiting messages, not: {reason}") from None
        self._waiting = self._value_of("SELECT count(*) FROM message")
        self._last = 0  # number of the last one that was handed over
        self._states: dict[str, str] = {}
        self._under_way: dict[int, _UnderWay] = {}
        self._handed = 0

    @property
    def waiting(self) -> int:
        """Messages that must not be lost, and are not acknowledged."""
        return self._waiting

    @property
    def empty(self) -> bool:
        """Whether everything, states included, is acknowledged."""
        return not (self._waiting or self._states or self._under_way)

    def put(self, topic: str, text: str) -> None:
        """Keep a message that must not be lost.

        Raises
        ------
        ToolError
            If the file does not take it.
        """
        if self._waiting >= MOST:
            self.left_out += 1
            return
        self._changed("INSERT INTO message (topic, text) VALUES (?, ?)", topic, text)
        self._waiting += 1

    def show(self, topic: str, text: str) -> None:
        """Keep the newest state of a topic, for the time when it can be handed over."""
        self._states[topic] = text

    def hand_over(self, hand: Hand) -> None:
        """Give the client what it may have now."""
        shown = {each.topic for each in self._under_way.values() if each.number is None}
        for topic in [topic for topic in self._states if topic not in shown]:
            if not self._room():
                return
            self._hand(hand, topic, self._states.pop(topic), None)
        free = WINDOW - sum(each.number is not None for each in self._under_way.values())
        query = "SELECT number, topic, text FROM message WHERE number > ? ORDER BY number LIMIT ?"
        for number, topic, text in self._kept.execute(query, (self._last, max(free, 0))).fetchall():
            if not self._room():
                return
            self._hand(hand, topic, text, number)
            self._last = number

    def acknowledged(self, client_number: int) -> None:
        """Note that the broker has acknowledged what has this number of the client."""
        message = self._under_way.pop(client_number, None)
        if message is not None and message.number is not None:
            self._changed("DELETE FROM message WHERE number = ?", message.number)
            self._waiting -= 1

    def close(self) -> None:
        """Leave what waits in the file, if there is one."""
        self._kept.close()

    def _open(self) -> None:
        self._kept.execute("PRAGMA locking_mode = EXCLUSIVE")
        if self._value_of("PRAGMA application_id") != _APPLICATION:
            if self._value_of("SELECT count(*) FROM sqlite_master"):
                raise sqlite3.DatabaseError("a database of another program")
            self._kept.execute(f"PRAGMA application_id = {_APPLICATION}")
        self._kept.execute("PRAGMA journal_mode = WAL")
        self._kept.execute("PRAGMA synchronous = NORMAL")  # a kill loses nothing
        # AUTOINCREMENT: a number is never used again.
        columns = "number INTEGER PRIMARY KEY AUTOINCREMENT, topic TEXT NOT NULL, text TEXT NOT NULL"
        self._kept.execute("BEGIN EXCLUSIVE")
        self._kept.execute(f"CREATE TABLE IF NOT EXISTS message ({columns})")
        self._kept.execute("COMMIT")

    def _room(self) -> bool:
        """Tell whether the client's next number cannot be that of a message under way."""
        oldest = min((each.place for each in self._under_way.values()), default=self._handed)
        return self._handed - oldest < SPAN

    def _hand(self, hand: Hand, topic: str, text: str, number: int | None) -> None:
        self._under_way[hand(topic, text, number is None)] = _UnderWay(self._handed, topic, number)
        self._handed += 1

    def _value_of(self, query: str) -> int:
        (value,) = self._kept.execute(query).fetchone()
        return int(value)

    def _changed(self, statement: str, *values: str | int) -> None:
        try:
            self._kept.execute(statement, values)
        except sqlite3.Error as error:
            raise self._full(error) from None

    def _full(self, error: sqlite3.Error) -> ToolError:
        return ToolError(f"{self._path or 'the memory'} must take the waiting messages, not: {error}")
