"""A board with converters at its pins: its results are those of the integer model fed with their codes, bit for bit."""

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from tests.sim.virtual_board.socket_line import SocketLine

import sosmith
from sosmith.gen.core import CoreDesign
from sosmith.gen.fpga.boards import find_board
from sosmith.host.board import Board
from sosmith.host.identity_check import check_files
from sosmith.host.monitor import Changed, Connected, Idle, Received, watch
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.model.arrays import Codes
from sosmith.model.dataflow.status import Flag
from sosmith.model.errors import SpecificationError
from sosmith.sim.converters.values import fed_codes
from sosmith.sim.virtual_board.netlist import Netlist, build

SPEC = {
    "name": "wheels",
    "sample_rate": 1000,
    "channels": 3,
    "input": {
        "voltage": {"bits": 16, "range": [0.0, 10.0]},
        "temperature": {"bits": 14, "range": [0.0, 128.0]},
    },
    "calibration": {"coefficients": [[1.16, -0.0036], [0.3672, 0.0006618], [0.05812]]},
    "filter": {"family": "butterworth", "kind": "lowpass", "order": 2, "cutoff": 50.0},
    "output": {"bits": 16, "range": [0.0, 16.0], "unit": "mm", "max_error": 0.005},
    "converter": {
        "voltage": {"device": "mcp3202", "range": [0.0, 10.0]},
        "temperature": {"device": "max31855"},
    },
    "hardware": {"clock": 4e6, "reload": True},
}
SAMPLES = 250


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("converters")


@pytest.fixture(scope="module")
def made(place: Path) -> sosmith.Design:
    design = sosmith.design(SPEC)
    design.generate(place / "files")
    return design


@pytest.fixture(scope="module")
def netlist(made: sosmith.Design, place: Path) -> Netlist:
    return build(made.core, place / "board", clock=Fraction(4_000_000))


def measured(design: CoreDesign) -> Codes:
    """Return codes that the converters cannot give exactly."""
    traces = traces_for(design, "wear_ramp", seed=3, seconds=SAMPLES / float(design.spec.sample_rate))
    return np.stack([trace.codes for trace in traces], axis=1)


class Restless:
    """A clock that does not wait."""

    def time(self) -> float:
        return 0.0

    def monotonic(self) -> float:
        return 0.0

    def sleep(self, seconds: float, /) -> None:
        pass


@contextmanager
def running(netlist: Netlist, codes: Codes | None) -> Iterator[Board]:
    """Run a board whose time stands still until the host asks again, so that no result is missed."""
    ours, theirs = socket.socketpair()
    with netlist.at(theirs.fileno(), wait=10_000, codes=codes):
        theirs.close()
        with Board.on(SocketLine(ours)) as board:
            yield board


def fetched(board: Board, count: int) -> tuple[list[int], list[int]]:
    """Fetch codes and status of so many results, from channel 0 on."""
    codes: list[int] = []
    status: list[int] = []
    for _ in range(10_000):
        if len(codes) >= count:
            break
        found = board.poll()
        if found is not None:
            channel, results = found
            assert channel == len(codes) % board.identity.channels
            codes += results.codes.tolist()
            status += results.status.tolist()
    assert len(codes) >= count
    return codes[:count], status[:count]


@pytest.mark.slow
def test_results_are_those_of_the_integer_model(made: sosmith.Design, netlist: Netlist, place: Path) -> None:
    codes = measured(made.core)
    assert netlist.schedule is not None
    fed = fed_codes(netlist.schedule, codes)
    assert 0 < np.abs(fed - codes).max() < 1 << 12
    with running(netlist, codes) as board:
        check_files(board.identity, place / "files")
        assert (board.identity.source, board.identity.flags["fault"]) == ("converter", Flag.FAULT)
        board.counters()
        found, status = fetched(board, 3 * SAMPLES)
        counters = board.counters()
        assert (counters["missed"], counters["refused"], counters["crc"]) == (0, 0, 0)
        assert set(board.readings().values()) == {()}
        assert board.read_register(0) != 0
        with pytest.raises(sosmith.RefusedError, match=r"^the board must carry out SAMPLES, not answer: "):
            board._session.request(3, b"\0")
        with pytest.raises(SpecificationError, match=r"^the samples must come from the board's converters, not over"):
            board.run_codes(codes)
    assert found == made.core.datapath.compute(fed).reshape(-1).tolist()
    assert status == made.core.datapath.compute_status(fed).reshape(-1).tolist()


@pytest.mark.slow
def test_without_converters_every_result_is_flagged(made: sosmith.Design, netlist: Netlist) -> None:
    with running(netlist, None) as board:
        found, status = fetched(board, 30)
        readings = board.readings()
        events = watch(lambda: board, lambda identity: pytest.fail("it must not be fed"), clock=Restless())
        told = next(event for event in islice(events, 50) if isinstance(event, Changed))
    assert told.readings == readings
    assert found == made.core.datapath.compute(np.zeros((10, 3, 2), np.int64)).reshape(-1).tolist()
    assert all(each >> Flag.FAULT & 1 for each in status)
    assert readings == {
        (channel, name): faults
        for channel in range(3)
        for name, faults in (
            ("voltage", ("frame",)),
            ("temperature", ("open", "short_to_ground", "short_to_supply", "frame", "range")),
        )
    }


@pytest.mark.slow
def test_results_that_nobody_fetches_are_missed_from_the_oldest_on(made: sosmith.Design, netlist: Netlist) -> None:
    codes = measured(made.core)
    with running(netlist, codes) as board:
        before = board.counters()["missed"]
        fetched(board, 6)
        for _ in range(480):  # time passes
            board.readings()
        found = board.poll()  # makes room: nothing is missed from here on
        missed = board.counters()["missed"] - before
    assert missed > 3
    assert found is not None
    assert found[0] == (6 + missed) % 3
    assert netlist.schedule is not None
    expected = made.core.datapath.compute(fed_codes(netlist.schedule, codes)).reshape(-1)
    assert found[1].codes.tolist() == expected[6 + missed :][: len(found[1].codes)].tolist()


@pytest.mark.slow
def test_a_monitor_numbers_whole_samples(made: sosmith.Design, netlist: Netlist) -> None:
    codes = measured(made.core)
    assert netlist.schedule is not None
    expected = made.core.datapath.compute(fed_codes(netlist.schedule, codes))
    with running(netlist, codes) as board:
        events = watch(lambda: board, lambda identity: pytest.fail("it must not be fed"), clock=Restless())
        assert isinstance(next(events), Connected)
        taken = 0
        while taken < 40:
            event = next(events)
            if isinstance(event, Idle):
                continue
            assert isinstance(event, Received)
            assert event.first == taken
            rows = event.results.codes
            assert rows.tolist() == expected[taken : taken + len(rows)].tolist()
            taken += len(rows)


@pytest.mark.slow
def test_the_gates_of_a_board_with_converters(made: sosmith.Design, place: Path) -> None:
    """What Yosys makes of front-end, link and core together, in the cells of an iCEBreaker."""
    codes = measured(made.core)
    netlist = build(made.core, place / "gates", clock=Fraction(4_000_000), gates=find_board("icebreaker"))
    assert netlist.schedule is not None
    with running(netlist, codes) as board:
        found, status = fetched(board, 90)
    fed = fed_codes(netlist.schedule, codes)[:30]
    assert found == made.core.datapath.compute(fed).reshape(-1).tolist()
    assert status == made.core.datapath.compute_status(fed).reshape(-1).tolist()
