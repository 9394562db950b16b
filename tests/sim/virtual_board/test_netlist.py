"""The netlist of a board's top in Verilator: bit for bit the integer model, at line rate, whatever the line does."""

import random
import socket
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from tests.gen.designs import EXAMPLES
from tests.gen.output.packages.made import HELD
from tests.interface.small import FILTER, filter_design, instrument_design
from tests.sim.virtual_board.running import running
from tests.sim.virtual_board.socket_line import SocketLine

import sosmith
from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.fpga.boards import find_board
from sosmith.gen.specification.specification import load
from sosmith.host import session
from sosmith.host.board import Board
from sosmith.host.identity_check import check_files
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.model.link.protocol import Type
from sosmith.sim.virtual_board.line_damage import LineDamage
from sosmith.sim.virtual_board.netlist import Netlist, build

BUILT: dict[Path, Netlist] = {}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("boards")


def netlist_of(design: CoreDesign, place: Path, clocks_per_bit: int = 4) -> Netlist:
    """Build a board, each one once."""
    folder = place / f"{design.spec.name}_{clocks_per_bit}"
    if folder not in BUILT:
        BUILT[folder] = build(design, folder, clock=Fraction(1_000_000 * clocks_per_bit), baud=1_000_000)
    return BUILT[folder]


def codes_for(design: CoreDesign, samples: int, seed: int = 1) -> np.ndarray:  # type: ignore[type-arg]
    rng = np.random.default_rng(seed)
    shape = (samples, design.spec.channels) if design.spec.channels > 1 else (samples,)
    return np.stack([rng.integers(p.lowest, p.highest + 1, shape) for p in design.datapath.inputs], axis=-1)


def test_results_are_those_of_the_model_and_the_identity_is_that_of_the_files(place: Path) -> None:
    made = filter_design()
    codes = codes_for(made.core, 3000)
    made.generate(place / "files")
    with running(netlist_of(made.core, place)) as port, Board(port) as board:
        manifest = check_files(board.identity, place / "files")
        results = board.run_codes(codes)
        faults = board.faults
        counters = board.counters()
    assert np.array_equal(results.codes, made.core.datapath.compute(codes))
    assert np.array_equal(results.status, made.core.datapath.compute_status(codes))
    assert set(counters.values()) == {0}
    assert (faults["damaged"], faults["gaps"]) == (0, 0)
    assert manifest["name"] == "plain"


def test_another_core_is_recognized(place: Path) -> None:
    instrument_design().generate(place / "gauge")
    for name in ("json", "certificate.json"):
        text = (place / "gauge" / f"gauge.{name}").read_text(encoding="utf-8")
        (place / "gauge" / f"plain.{name}").write_text(text.replace("gauge.sv", "plain.sv"), encoding="utf-8")
    expected = r"^the board's design must be [0-9a-f]{12}, not [0-9a-f]{12}; its core is plain$"
    with running(netlist_of(filter_design().core, place)) as port, Board(port) as board:
        about = board.identity
    with pytest.raises(sosmith.ShortfallError, match=expected):
        check_files(about, place / "gauge")


@pytest.mark.slow
def test_another_core_of_the_same_name_is_built_in_the_folder_of_one_that_runs(place: Path) -> None:
    first = filter_design()
    second = sosmith.design({**FILTER, "filter": {**FILTER["filter"], "cutoff": 30.0}})
    codes, folder = codes_for(first.core, 200), place / "shared"
    rate, baud = Fraction(4_000_000), 1_000_000
    with running(build(first.core, folder, clock=rate, baud=baud)) as port, Board(port) as board:
        with running(build(second.core, folder, clock=rate, baud=baud)) as other, Board(other) as beside:
            assert np.array_equal(beside.run_codes(codes).codes, second.core.datapath.compute(codes))
        assert np.array_equal(board.run_codes(codes).codes, first.core.datapath.compute(codes))


def test_the_line_is_busy_for_four_fifths_of_the_time(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At 4 clocks per bit, as for 3 Mbaud at 12 MHz; the time that counts is the board's own."""
    for limit in ("_SHORTEST", "_LONGEST"):  # of the host's patience, which a busy machine must not try
        monkeypatch.setattr(session, limit, 30.0)
    made = filter_design().core
    ours, theirs = socket.socketpair()
    with netlist_of(made, place).at(theirs.fileno(), wait=1000) as process:
        theirs.close()
        with Board.on(SocketLine(ours)) as board:
            results = board.run_codes(codes_for(made, 60 * 80))
        assert process.stdout is not None
        clocks, _, sent = map(int, process.stdout.read().split())
    assert np.array_equal(results.codes, made.datapath.compute(codes_for(made, 60 * 80)))
    useful = 10 * 4 * 3 * 60 * 80  # bits of a byte, clocks of a bit, bytes of a result
    assert sent * 10 * 4 <= clocks
    assert useful >= 0.8 * clocks


@pytest.mark.slow
def test_damage_is_mended_and_counted(place: Path) -> None:
    made = filter_design().core
    codes = codes_for(made, 4000)
    damage = LineDamage(1000, 5)
    with running(netlist_of(made, place), damage) as port, Board(port) as board:
        board.counters()
        results = board.run_codes(codes)
        counters, timeouts = board.counters(), board.faults["timeouts"]
    assert np.array_equal(results.codes, made.datapath.compute(codes))
    assert damage.count > 10
    assert counters["crc"] + counters["malformed"] > 3
    assert counters["refused"] == counters["framing"] == 0
    # A host that loses patience on a busy machine asks again for what is still on its way: more than its credit.
    assert counters["overrun"] == 0 or timeouts


@pytest.mark.slow
def test_arbitrary_bytes_do_not_wedge_the_board(place: Path) -> None:
    made = filter_design().core
    codes = codes_for(made, 100)
    chance = random.Random(3)
    ours, theirs = socket.socketpair()
    with netlist_of(made, place).at(theirs.fileno()):
        theirs.close()
        for _ in range(10):
            noise = bytes(chance.choice([0, chance.randrange(256), chance.randrange(9)]) for _ in range(700))
            ours.sendall(noise)
            board = Board.on(SocketLine(ours.dup()))
            assert np.array_equal(board.run_codes(codes).codes, made.datapath.compute(codes))
            board.close()
    ours.close()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["held", "held_folded"])
def test_a_held_result_is_there_for_each_sample(name: str, place: Path) -> None:
    """One sample a request, which waits for the result of the one before; then as many as fit, damaged ones too."""
    spec = (
        HELD if name == "held" else {**HELD, "name": name, "hardware": {**HELD["hardware"], "architecture": "folded"}}
    )
    made = sosmith.design(spec).core
    codes = codes_for(made, 500)
    expected, status = (np.repeat(of(codes), 4) for of in (made.datapath.compute, made.datapath.compute_status))
    with running(netlist_of(made, place)) as port:
        with Board(port) as board:
            found = [board.run_codes(part) for part in (*np.split(codes[:22], 22), codes[22:])]
        with Board(port) as board:
            again = board.run_codes(codes[:3])
    assert np.concatenate([results.codes for results in found]).tolist() == expected.tolist()
    assert np.concatenate([results.status for results in found]).tolist() == status.tolist()
    assert again.codes.tolist() == expected[:3].tolist()
    damage = LineDamage(200, 3)
    with running(netlist_of(made, place), damage) as port, Board(port) as board:
        assert board.run_codes(codes).codes.tolist() == expected.tolist()
    assert damage.count > 3


def locomotive(channels: int) -> CoreDesign:
    """Design the instrument of the locomotive for a number of wheels."""
    return design_core(replace(load(EXAMPLES / "flange_wear_locomotive.toml"), channels=channels))


@pytest.mark.slow
@pytest.mark.parametrize("channels", [1, 12])
def test_the_locomotive_over_the_port(channels: int, place: Path) -> None:
    design = locomotive(channels)
    traces = traces_for(design, "wear_ramp", seed=1, seconds=10_000 / float(design.spec.sample_rate))
    codes = np.stack([trace.codes for trace in traces], axis=1)
    folder = place / f"locomotive_{channels}"
    with running(build(design, folder, clock=Fraction(12_000_000))) as port, Board(port) as board:
        results = board.run_codes(codes)
        faults, counters = board.faults, board.counters()
    assert codes.shape == (10_000, channels, 2)
    shown = codes[:, 0] if channels == 1 else codes
    assert np.array_equal(results.codes, design.datapath.compute(shown))
    assert np.array_equal(results.status, design.datapath.compute_status(shown))
    assert (faults["damaged"], set(counters.values())) == (0, {0})


@pytest.mark.slow
@pytest.mark.parametrize(("channels", "target"), [(1, "icebreaker"), (12, "icebreaker"), (1, "icestick")])
def test_the_gates_of_the_whole_board(channels: int, target: str, place: Path) -> None:
    """What Yosys makes of UART, protocol and core together, in the cells of the FPGA."""
    design = locomotive(channels)
    codes = codes_for(design, 300 // channels)
    folder = place / f"gates_{channels}_{target}"
    netlist = build(design, folder, clock=Fraction(12_000_000), gates=find_board(target))
    assert "SB_DFF" in (folder / "gates" / "gates.v").read_text(encoding="utf-8")
    with running(netlist) as port, Board(port) as board:
        about, results = board.identity, board.run_codes(codes)
        faults, counters = board.faults, board.counters()
    assert (about.name, about.channels) == ("flange_wear_locomotive", channels)
    assert np.array_equal(results.codes, design.datapath.compute(codes))
    assert np.array_equal(results.status, design.datapath.compute_status(codes))
    assert (faults["damaged"], set(counters.values())) == (0, {0})


@pytest.mark.slow
def test_two_hundred_thousand_frames_over_a_damaged_line(place: Path) -> None:
    made = filter_design().core
    count = 100_000  # requests, and as many responses
    codes = codes_for(made, count)
    samples = codes[:, 0].astype("<i2").tobytes()
    with running(netlist_of(made, place), LineDamage(1000, 9)) as port, Board(port) as board:
        requests = ((Type.SAMPLES, b"\0" + samples[2 * n : 2 * n + 2]) for n in range(count))
        received = b"".join(board._session.exchange(requests))
        counters, timeouts = board.counters(), board.faults["timeouts"]
    found = np.frombuffer(received, "<i2,u1")
    assert np.array_equal(found["f0"], made.datapath.compute(codes))
    assert counters["overrun"] == 0 or timeouts
