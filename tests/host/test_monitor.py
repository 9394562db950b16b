"""Watching a board: samples as they are due, and sessions that go on after the board was unplugged."""

from collections.abc import Callable, Iterator
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest
from tests.host.lines import BadLine, device_of, plain_device
from tests.host.ports import plugged
from tests.interface.small import filter_design, instrument_design

import sosmith
from sosmith.host.board import Board
from sosmith.host.monitor import RETRY, TURN, Connected, Event, Lost, Received, watch
from sosmith.model.errors import ToolError
from sosmith.model.link.identity import Identity


class Time:
    """Time that passes only while somebody sleeps."""

    def __init__(self) -> None:
        self.now = 0.0
        self.slept: list[float] = []

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float, /) -> None:
        self.slept.append(seconds)
        self.now += seconds


CODES = np.random.default_rng(1).integers(-512, 512, (400, 1, 1))


def received(events: list[Event]) -> list[Received]:
    return [event for event in events if isinstance(event, Received)]


def test_samples_are_sent_as_they_are_due() -> None:
    clock = Time()
    told = []
    for event in watch(lambda: Board.on(BadLine(plain_device())), lambda identity: CODES, clock=clock):
        if isinstance(event, Received):
            told.append((clock.now, event.first, len(event.results.codes)))
    assert [first for _, first, _ in told] == [0, *np.cumsum([count for *_, count in told])[:-1].tolist()]
    assert sum(count for *_, count in told) == 400
    rate = 1000.0  # of the design, in Hz
    assert all(first + count <= now * rate + 1 + 1e-6 for now, first, count in told)
    assert all(first + count >= now * rate - 1 - 1e-6 for now, first, count in told[:-1])
    assert min(clock.slept) >= TURN


def test_at_once_there_is_no_waiting() -> None:
    clock = Time()
    events = list(watch(lambda: Board.on(BadLine(plain_device())), lambda identity: CODES, speed=0, clock=clock))
    assert [type(event) for event in events] == [Connected, Received]
    expected = filter_design().core.datapath.compute(CODES[:, 0])
    assert np.array_equal(received(events)[0].results.codes, expected)
    assert clock.slept == []


def test_after_a_loss_it_goes_on_with_the_next_sample_from_reset() -> None:
    device, clock = plain_device(), Time()
    lines: list[BadLine] = []
    failures = iter([False, True, True, False, False])

    def connect() -> Board:
        if next(failures):
            raise ToolError("no such port")
        lines.append(BadLine(device))
        return Board.on(lines[-1])

    events: list[Event] = []
    for event in watch(connect, lambda identity: CODES, clock=clock):
        events.append(event)
        if isinstance(event, Received) and event.first in range(100, 130) and event.session == 1:
            lines[-1].unplugged = True
    kinds = [type(event).__name__ for event in events if not isinstance(event, Received)]
    assert kinds == ["Connected", "Lost", "Connected"]
    assert next(event for event in events if isinstance(event, Lost)).reason.endswith("not: unplugged")
    assert clock.slept.count(RETRY) == 2
    assert lines[0].closed
    _sessions_are_those_of_the_model(received(events))
    assert sum(len(event.results.codes) for event in received(events)) == len(CODES)


def _sessions_are_those_of_the_model(events: list[Received]) -> None:
    """Each session starts from reset, with the sample after the last one whose result came."""
    for _, session in groupby(events, lambda event: event.session):
        parts = list(session)
        codes = CODES[parts[0].first : parts[-1].first + len(parts[-1].results.codes)]
        expected = filter_design().core.datapath.compute(codes[:, 0])
        assert np.array_equal(np.concatenate([part.results.codes for part in parts]), expected)


def test_without_a_board_at_first_there_is_an_error() -> None:
    def connect() -> Board:
        raise ToolError("no such port")

    with pytest.raises(ToolError, match=r"^no such port$"):
        next(watch(connect, lambda identity: CODES, clock=Time()))


def test_another_board_in_the_second_session_is_not_fed() -> None:
    lines = iter([BadLine(plain_device()), BadLine(device_of(instrument_design()))])
    used: list[BadLine] = []

    def connect() -> Board:
        used.append(next(lines))
        return Board.on(used[-1])

    def check(identity: Identity) -> None:
        if identity.name != "plain":
            raise sosmith.ShortfallError("another one")

    events = watch(connect, lambda identity: CODES, check=check, clock=Time())
    with pytest.raises(sosmith.ShortfallError, match=r"^another one$"):
        _until_the_end(events, lambda: setattr(used[0], "unplugged", True))
    assert used[1].closed


def _until_the_end(events: Iterator[Event], unplug: Callable[[], None]) -> None:
    for event in events:
        if isinstance(event, Received):
            unplug()


@pytest.mark.parametrize("times", [3, pytest.param(50, marks=pytest.mark.slow)])
def test_a_port_that_is_unplugged_and_comes_back(times: int, tmp_path: Path) -> None:
    device, link = plain_device(), tmp_path / "port"
    plug = plugged(device, link)
    port = plug.__enter__()
    events = watch(lambda: Board(port), lambda identity: CODES, speed=10)
    told: list[Event] = []
    losses = 0
    for event in events:
        told.append(event)
        if isinstance(event, Received) and losses < times:
            plug.__exit__(None, None, None)
            losses += 1
        elif isinstance(event, Lost):
            plug = plugged(device, link)
            plug.__enter__()
    plug.__exit__(None, None, None)
    assert [type(event) for event in told].count(Lost) == times
    assert sum(len(event.results.codes) for event in received(told)) == len(CODES)
    assert received(told)[-1].session == times + 1
    _sessions_are_those_of_the_model(received(told))
