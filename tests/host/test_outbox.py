"""Messages on their way to a broker: none is lost, doubled or taken for another, whatever becomes of the connection."""

import random
import sqlite3
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from sosmith.host import outbox as module
from sosmith.host.outbox import Outbox
from sosmith.model.errors import SpecificationError, ToolError


class Client:
    """A client as paho is, and the broker behind it: numbers of 16 bits, copies after an absence, any order.

    Attributes
    ----------
    given : Counter
        How often each alarm was given to the client.
    acknowledged : set
        Alarms that the broker has acknowledged.
    mixed_up : int
        Messages whose number was that of another one under way.
    """

    def __init__(self, rng: random.Random, numbers: int) -> None:
        self._rng, self._numbers, self._last = rng, numbers, 0
        self._out: dict[int, str] = {}
        self.given: Counter[str] = Counter()
        self.acknowledged: set[str] = set()
        self.published = self.mixed_up = self.copies = 0

    def hand(self, topic: str, text: str, retain: bool) -> int:
        self._last = self._last % self._numbers + 1
        self.published += 1
        self.mixed_up += self._last in self._out
        self._out[self._last] = "" if retain else text
        if not retain:
            self.given[text] += 1
        return self._last

    def acknowledge(self, most: int) -> list[int]:
        """Acknowledge some of what is under way."""
        numbers = list(self._out)
        chosen = self._rng.sample(numbers, min(self._rng.randint(0, most), len(numbers)))
        self.acknowledged.update(self._out.pop(number) for number in chosen)
        return chosen


def run(publications: int, numbers: int) -> tuple[Outbox, Client, int]:
    """Publish the states of 12 channels and alarms while the broker comes and goes; return the alarms as well."""
    rng = random.Random(1)
    outbox, client = Outbox(), Client(rng, numbers)
    alarms, undrained = 0, list[int]()
    connected, until = True, 0
    turn = 0
    while client.published < publications:
        turn += 1
        if turn >= until:
            connected, until = not connected, turn + rng.randint(1, 400)
        for channel in range(12):
            outbox.show(f"T/channel/{channel}", str(turn))
        for _ in range(rng.choice((0, 0, 0, 1, 2))):
            alarms += 1
            outbox.put("T/alarm", str(alarms))
        for number in undrained:
            outbox.acknowledged(number)
        assert outbox.waiting == alarms - len(client.acknowledged - {""})
        undrained = []
        if connected:
            outbox.hand_over(client.hand)
            undrained = client.acknowledge(40)
    while True:
        for number in undrained:
            outbox.acknowledged(number)
        if outbox.empty:
            return outbox, client, alarms
        outbox.hand_over(client.hand)
        undrained = client.acknowledge(40)


def judge(publications: int, numbers: int) -> None:
    outbox, client, alarms = run(publications, numbers)
    assert client.published >= publications > 2 * numbers
    assert alarms > publications // 100
    assert client.given == Counter(str(n) for n in range(1, alarms + 1))
    assert client.acknowledged - {""} == set(client.given)
    assert (client.mixed_up, outbox.waiting, outbox.left_out) == (0, 0, 0)


def test_twenty_thousand_publications(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SPAN", 400)
    judge(20_000, 1000)


@pytest.mark.slow
def test_two_hundred_thousand_publications() -> None:
    judge(200_000, 65_535)


def test_a_message_that_is_never_acknowledged_stops_what_could_be_taken_for_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "SPAN", 400)
    outbox, client = Outbox(), Client(random.Random(1), 1000)
    outbox.put("T/alarm", "first")
    outbox.hand_over(client.hand)
    for turn in range(2000):
        outbox.show("T/channel/0", str(turn))
        outbox.hand_over(client.hand)
        if client.published > 1:
            outbox.acknowledged(client.published)
    assert (client.published, outbox.waiting) == (400, 1)
    outbox.acknowledged(1)
    assert outbox.waiting == 0
    outbox.hand_over(client.hand)
    assert client.published == 401


def test_an_acknowledgement_of_something_else_is_none() -> None:
    outbox = Outbox()
    outbox.put("T/alarm", "a")
    outbox.acknowledged(1)
    outbox.hand_over(lambda *_: 7)
    outbox.acknowledged(1)
    assert (outbox.waiting, outbox.empty) == (1, False)
    outbox.acknowledged(7)
    assert (outbox.waiting, outbox.empty) == (0, True)


def test_the_client_has_a_window_of_messages_in_order() -> None:
    outbox, given = Outbox(), list[str]()

    def hand(topic: str, text: str, retain: bool) -> int:
        given.append(text)
        return len(given)

    for n in range(50):
        outbox.put("T/alarm", str(n))
    outbox.hand_over(hand)
    outbox.hand_over(hand)
    assert given == [str(n) for n in range(20)]
    outbox.acknowledged(3)
    outbox.acknowledged(1)
    outbox.hand_over(hand)
    assert given == [str(n) for n in range(22)]


def test_of_a_state_the_newest_counts() -> None:
    outbox, given = Outbox(), list[tuple[str, str, bool]]()

    def hand(topic: str, text: str, retain: bool) -> int:
        given.append((topic, text, retain))
        return len(given)

    outbox.show("T/status", "connected")
    outbox.hand_over(hand)
    for state in ("lost", "connected", "ended"):
        outbox.show("T/status", state)
        outbox.hand_over(hand)
    outbox.acknowledged(1)
    outbox.hand_over(hand)
    assert given == [("T/status", "connected", True), ("T/status", "ended", True)]


def test_when_too_many_wait_the_newest_are_left_out_and_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST", 3)
    outbox, given = Outbox(), list[str]()
    for n in range(5):
        outbox.put("T/alarm", str(n))
    assert (outbox.waiting, outbox.left_out) == (3, 2)
    outbox.hand_over(lambda topic, text, retain: given.append(text) or len(given))  # type: ignore[func-returns-value]
    assert given == ["0", "1", "2"]
    outbox.acknowledged(1)
    outbox.put("T/alarm", "5")
    assert (outbox.waiting, outbox.left_out) == (3, 2)


def test_a_kill_and_a_restart_lose_nothing(tmp_path: Path) -> None:
    code = """
import os, pathlib, signal, sys
from sosmith.host.outbox import Outbox
outbox = Outbox(pathlib.Path(sys.argv[1]))
for n in range(30):
    outbox.put("T/alarm", str(n))
outbox.hand_over(lambda topic, text, retain: int(text))
for n in (0, 2, 19):
    outbox.acknowledged(n)
os.kill(os.getpid(), signal.SIGKILL)
"""
    path = tmp_path / "alarms"
    subprocess.run([sys.executable, "-c", code, str(path)], check=False)
    for expected in ([n for n in range(30) if n not in {0, 2, 19}], []):
        outbox, given = Outbox(path), list[int]()
        while outbox.waiting:
            outbox.hand_over(lambda topic, text, retain: given.append(int(text)) or int(text))  # type: ignore[func-returns-value]  # noqa: B023
            for number in given:
                outbox.acknowledged(number)
        outbox.close()
        assert given == expected


def test_a_file_of_something_else_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "alarms"
    path.write_text("a letter\n" * 100)
    expected = r"alarms: the file must be one of waiting messages, not: file is not a database$"
    with pytest.raises(SpecificationError, match=expected):
        Outbox(path)
    assert path.read_text() == "a letter\n" * 100
    with pytest.raises(SpecificationError, match=r"^/dev/full: the output must be a regular file, not a device$"):
        Outbox(Path("/dev/full"))
    with pytest.raises(SpecificationError, match=r"the file of waiting messages must be in a folder that is there$"):
        Outbox(tmp_path / "none" / "alarms")


def test_a_database_of_another_program_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "store"
    other = sqlite3.connect(path)
    other.execute("CREATE TABLE message (a)")
    other.commit()
    other.close()
    before = path.read_bytes()
    expected = r"store: the file must be one of waiting messages, not: a database of another program$"
    with pytest.raises(SpecificationError, match=expected):
        Outbox(path)
    assert path.read_bytes() == before


def test_a_file_has_one_user(tmp_path: Path) -> None:
    first = Outbox(tmp_path / "alarms")
    expected = r"alarms: the file must be one of waiting messages, not: in use by another process$"
    with pytest.raises(SpecificationError, match=expected):
        Outbox(tmp_path / "alarms")
    first.close()
    Outbox(tmp_path / "alarms").close()


def test_a_file_on_a_full_disk_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = sqlite3.connect

    def connect(*arguments: Any, **options: Any) -> sqlite3.Connection:
        connection = real(*arguments, **options)
        connection.execute("PRAGMA max_page_count = 1")
        return connection

    monkeypatch.setattr(sqlite3, "connect", connect)
    with pytest.raises(ToolError, match=r"alarms must take the waiting messages, not: database or disk is full$"):
        Outbox(tmp_path / "alarms")


def test_a_file_that_takes_nothing_more_is_told(tmp_path: Path) -> None:
    outbox = Outbox(tmp_path / "alarms")
    outbox._kept.execute("PRAGMA max_page_count = 8")
    expected = r"alarms must take the waiting messages, not: database or disk is full$"

    def fill() -> None:
        for _ in range(100):
            outbox.put("T/alarm", "x" * 1000)

    with pytest.raises(ToolError, match=expected):
        fill()
    outbox.close()
