"""Watching a board: samples as they are due, and sessions that go on after the board was unplugged."""

import math
import random
from collections.abc import Callable, Iterator
from itertools import groupby, islice, pairwise
from pathlib import Path

import numpy as np
import pytest
from tests.host.lines import BadLine, ScriptedLine, plain_device
from tests.host.measuring import MeasuringDevice, measuring_identity
from tests.host.ports import plugged
from tests.interface.small import filter_design

import sosmith
from sosmith.host.board import Board
from sosmith.host.clock import TimeBase
from sosmith.host.monitor import RETRY, TURN, Connected, Event, Idle, Lost, Received, watch
from sosmith.model.errors import ToolError
from sosmith.model.link.device import Device
from sosmith.model.link.frames import Message
from sosmith.model.link.identity import Identity


class Time:
    """Time that passes only while somebody sleeps."""

    def __init__(self) -> None:
        self.now, self.utc = 0.0, 1e9
        self.slept: list[float] = []

    def time(self) -> float:
        return self.now + self.utc

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
    kinds = [type(event).__name__ for event in events if not isinstance(event, Received | Idle)]
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


def test_a_board_that_the_check_refuses_is_not_fed() -> None:
    used = [BadLine(plain_device()), BadLine(plain_device())]
    lines, calls = iter(used), iter([None, sosmith.ShortfallError("another one")])

    def check(identity: Identity) -> None:
        if error := next(calls):
            raise error

    events = watch(lambda: Board.on(next(lines)), lambda identity: CODES, check=check, clock=Time())
    with pytest.raises(sosmith.ShortfallError, match=r"^another one$"):
        _until_the_end(events, lambda: setattr(used[0], "unplugged", True))
    assert used[1].closed


def other(**changes: object) -> Device:
    """Return a board with another identity than that of `plain_device`."""
    made = plain_device()
    return Device(Identity.model_validate(made._identity.model_dump() | changes), made._core)


PLAIN = plain_device()._identity
SWAPPED = {
    "name": "other",
    "design": "0" * 64,
    "sosmith": "9",
    "channels": 2,
    "sample_rate": 2000.0,
    "clock": 1e6,
    "baud": 9600,
    "output": (*PLAIN.output[:4], 2 * PLAIN.output[4], PLAIN.output[5]),
    "inputs": (("x", 11, *PLAIN.inputs[0][2:]),),
    "flags": {name: 7 - bit for name, bit in PLAIN.flags.items()},
    "reload": {"design": 1, "words": 2},
}


@pytest.mark.parametrize("key", SWAPPED)
def test_another_board_in_the_second_session_is_told_and_not_fed(key: str) -> None:
    used = [BadLine(plain_device()), BadLine(other(**{key: SWAPPED[key]}))]
    lines = iter(used)
    events = watch(lambda: Board.on(next(lines)), lambda identity: CODES, clock=Time())
    with pytest.raises(sosmith.ShortfallError) as caught:
        _until_the_end(events, lambda: setattr(used[0], "unplugged", True))
    now, before = getattr(used[1].device._identity, key), getattr(PLAIN, key)
    assert str(caught.value) == (
        f"the board must be the one of the sessions before, not another: its {key} is {now}, not {before}"
    )
    assert used[1].closed
    assert next(lines, None) is None


def test_the_same_board_in_the_second_session_goes_on() -> None:
    used = [BadLine(plain_device()), BadLine(plain_device())]
    lines = iter(used)
    events = []
    for event in watch(lambda: Board.on(next(lines)), lambda identity: CODES, clock=Time()):
        events.append(event)
        used[0].unplugged |= isinstance(event, Received)
    assert sum(len(event.results.codes) for event in received(events)) == len(CODES)


@pytest.mark.parametrize("converters", [False, True])
@pytest.mark.parametrize(("outage", "set_by"), [(0.0, 0.0), (3600.0, 0.0), (3600.0, -7200.0), (10.0, 86400.0)])
def test_times_are_right_after_an_outage(converters: bool, outage: float, set_by: float) -> None:
    """Also where somebody sets the host's clock during it; samples are 10 ms apart, and come every 50 ms."""
    clock = Time()
    identity = measuring_identity() if converters else other(sample_rate=100.0)._identity
    made = plain_device()
    device = MeasuringDevice(lambda: clock.now, identity) if converters else Device(identity, made._core)
    lines: list[BadLine] = []
    back = 0.0

    def connect() -> Board:
        if clock.now < back:
            raise ToolError("no such port")
        lines.append(BadLine(device))
        return Board.on(lines[-1])

    told: list[Received] = []
    for event in watch(connect, lambda identity: CODES, clock=clock):
        if not isinstance(event, Received):
            continue
        told.append(event)
        newest = event.start + (event.first + len(event.results.codes) - 1) / 100
        assert abs(newest - clock.time()) <= 0.1
        if event.first > 100 and not back:
            lines[-1].unplugged, back = True, clock.now + outage
            clock.utc += set_by
        if event.first > 300:
            break
    assert {event.session for event in told} == {1, 2}


@pytest.mark.parametrize("set_by", [-3600.0, 3600.0])
def test_within_a_session_times_go_on_whatever_somebody_does_to_the_clock(set_by: float) -> None:
    clock = Time()
    device = MeasuringDevice(lambda: clock.now, measuring_identity())
    begun, times = clock.time(), []
    for event in watch(lambda: Board.on(BadLine(device)), lambda identity: CODES, clock=clock):
        if isinstance(event, Received):
            times += [event.start + (event.first + n) / 100 for n in range(len(event.results.codes))]
            clock.utc = 1e9 + (set_by if event.first > 50 else 0)
            if event.first > 100:
                break
    assert times == sorted(times)
    assert times[-1] == pytest.approx(begun + clock.now, abs=0.1)


def test_times_are_right_after_results_were_missed() -> None:
    """A host that stands still for an hour misses all but the latest results; their times are those of now."""
    clock = Time()
    device = MeasuringDevice(lambda: clock.now, measuring_identity(channels=3))
    for event in watch(lambda: Board.on(BadLine(device)), lambda identity: CODES, clock=clock):
        if isinstance(event, Received):
            newest = event.start + (event.first + len(event.results.codes) - 1) / 100
            assert abs(newest - clock.time()) <= 0.1
            if event.first == 100:
                clock.now += 3600
            if event.first > 300:
                break


def test_packed_results_of_a_board_that_measures() -> None:
    clock = Time()
    device = MeasuringDevice(lambda: clock.now, measuring_identity(2).model_copy(update={"packed": (0, 6)}))
    device.status = 0x41
    numbers: list[int] = []
    for event in watch(lambda: Board.on(BadLine(device)), lambda identity: CODES, clock=clock):
        if isinstance(event, Received):
            numbers += event.results.codes[:, 1].tolist()
            assert np.all(event.results.status == 0x41)
            if len(numbers) > 90:
                break
    assert numbers == list(range(len(numbers)))


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_times_follow_a_board_whose_clock_is_wrong(factor: float) -> None:
    clock = Time()
    device = MeasuringDevice(lambda: clock.now * factor, measuring_identity())
    times: list[float] = []
    for event in watch(lambda: Board.on(BadLine(device)), lambda identity: CODES, clock=clock):
        if isinstance(event, Received):
            times += [event.start + (event.first + n) / 100 for n in range(len(event.results.codes))]
            assert abs(times[-1] - clock.time()) <= 0.2
            if clock.now > 40:
                break
    assert min(after - before for before, after in pairwise(times)) > -0.001


def test_results_that_came_before_the_line_was_lost_count() -> None:
    clock = Time()
    device = MeasuringDevice(lambda: clock.now, measuring_identity())
    clock.now = 2.0  # more than one response holds
    line = BadLine(device)
    polled = Board._polled

    def lost(board: Board, body: bytes) -> object:
        line.unplugged = True
        return polled(board, body)

    events = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Board, "_polled", lost)
        for event in watch(lambda: Board.on(line), lambda identity: CODES, clock=clock):
            events.append(event)
            if isinstance(event, Lost):
                break
    (first,) = received(events)
    assert first.results.codes.tolist() == list(range(80))


def test_a_board_that_refuses_to_be_asked_ends_the_watch() -> None:
    refusing = Device(measuring_identity(), plain_device()._core)  # the model knows no POLL
    events = watch(lambda: Board.on(BadLine(refusing)), lambda identity: CODES, clock=Time())
    assert isinstance(next(events), Connected)
    with pytest.raises(sosmith.RefusedError, match=r"^the board must carry out POLL, not answer: the device has no "):
        next(events)


def test_a_board_that_says_nonsense_after_it_was_unplugged_ends_the_watch() -> None:
    lines = iter([BadLine(plain_device()), ScriptedLine(Message(0x81, 0, bytes([2, 4, 0])).frame)])
    first: list[BadLine] = []

    def connect() -> Board:
        first.append(next(lines))  # type: ignore[arg-type]
        return Board.on(first[-1])

    events = watch(connect, lambda identity: CODES, clock=Time())
    with pytest.raises(sosmith.LinkError, match=r"^the board must speak version 1 of the protocol, not answer with "):
        _until_the_end(events, lambda: setattr(first[0], "unplugged", True))


def test_while_nothing_comes_every_turn_is_told() -> None:
    clock = Time()
    device = MeasuringDevice(lambda: 0.0, measuring_identity())
    events = watch(lambda: Board.on(BadLine(device)), lambda identity: CODES, clock=clock)
    kinds = [type(event).__name__ for event in islice(events, 4)]
    assert kinds == ["Connected", "Idle", "Idle", "Idle"]
    assert clock.slept == [TURN, TURN]


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


@pytest.mark.parametrize("rate", [10.0, 100.0, 5000.0])
def test_times_of_a_session_never_go_back_however_late_results_come(rate: float) -> None:
    """Results come up to half a turn after they were measured, by chance; times are right to a tenth of a second."""
    clock, rng, told, first = Time(), random.Random(1), -math.inf, 0
    base = TimeBase(clock, rate)
    for _ in range(300):
        clock.sleep(rng.uniform(0.0, TURN) + 1 / rate)
        measured = int((clock.now - rng.uniform(0.0, TURN / 2)) * rate)
        if measured < first:
            continue
        base.came(measured, clock.monotonic())
        begins, ends = (base.start + n / rate for n in (first, measured))
        assert begins > told
        told, first = ends, measured + 1
        assert told == pytest.approx(clock.time(), abs=0.1 + 1 / rate)
