"""A board with audio converters at its pins: what its DACs get equals the integer model's results, bit for bit."""

import socket
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from tests.sim.virtual_board.socket_line import SocketLine

import sosmith
from sosmith.gen.fpga.boards import BOARDS
from sosmith.gen.output.board_top import wiring_of
from sosmith.host import session
from sosmith.host.board import Board
from sosmith.model.arrays import Codes
from sosmith.model.converters.i2s_frame import LATENCY
from sosmith.sim.converters.values import fed_codes
from sosmith.sim.virtual_board.netlist import Netlist, build

SPEC = {
    "name": "stereo",
    "sample_rate": 48000,
    "channels": 2,
    "input": {"x": {"bits": 24, "signed": True, "range": [-1.0, 1.0]}},
    "filter": {"family": "butterworth", "kind": "lowpass", "order": 2, "cutoff": 3000.0},
    "output": {"bits": 24, "signed": True, "range": [-1.0, 1.0], "max_error": 1e-5},
    "converter": {"x": {"device": "pcm1808"}, "output": {"device": "pcm5102a"}},
    "hardware": {"clock": 24.576e6},
}
FRAMES = 1000
PATIENCE = 60.0
"""Seconds of this machine that a host waits for a response; the time that counts is the board's own."""


@pytest.fixture(scope="module")
def made() -> sosmith.Design:
    return sosmith.design(SPEC)


def signal(channels: int, bits: int, seed: int = 1) -> Codes:
    """Return noise at full scale, a sample of each end of the range, and silence."""
    chance = np.random.default_rng(seed)
    top = 1 << bits - 1
    codes = chance.integers(-top, top, (FRAMES, channels, 1))
    codes[0], codes[1], codes[-50:] = -top, top - 1, 0
    return codes


def expected(made: sosmith.Design, netlist: Netlist, codes: Codes) -> Codes:
    assert netlist.schedule is not None
    assert netlist.schedule.writing is not None
    fed = fed_codes(netlist.schedule, codes)
    words = netlist.schedule.writing.words(made.core.datapath.compute(fed))
    return np.concatenate([np.zeros((netlist.schedule.silent, codes.shape[1]), np.int64), words])


@pytest.mark.slow
@pytest.mark.parametrize(
    "clock",
    [pytest.param("ulx3s_25f", id="ULX3S"), pytest.param(24_576_000, id="exact", marks=pytest.mark.slow)],
)
def test_stereo_at_48_khz_leaves_two_frames_later(made: sosmith.Design, clock: str | int, tmp_path: Path) -> None:
    """At the clock that a ULX3S makes, from the text that `sosmith build` takes."""
    rate = Fraction(clock) if isinstance(clock, int) else wiring_of(made.core, BOARDS[clock]).clock(BOARDS[clock])
    netlist = build(made.core, tmp_path, clock=rate)
    assert netlist.schedule is not None
    assert netlist.schedule.silent == LATENCY
    assert float(rate / netlist.schedule.period) == pytest.approx(48_000, rel=3e-4)
    codes = signal(2, 24)
    assert np.array_equal(netlist.play(codes), expected(made, netlist, codes))


@pytest.mark.slow
def test_three_channels_of_16_bits_that_a_dac_clips(tmp_path: Path) -> None:
    """Two converters in and out, the last with one channel; the DAC has half the range of the output."""
    narrow = {"bits": 16, "signed": True, "range": [-1.0, 1.0]}
    spec = SPEC | {
        "channels": 3,
        "input": {"x": narrow},
        "output": narrow,
        "converter": {"x": {"device": "cs5343"}, "output": {"device": "cs4344", "range": [-0.5, 0.5]}},
    }
    made = sosmith.design(spec)
    netlist = build(made.core, tmp_path)
    codes = signal(3, 16)
    wanted = expected(made, netlist, codes)
    assert {wanted.min(), wanted.max()} == {-(1 << 23), (1 << 23) - 1}
    assert np.array_equal(netlist.play(codes), wanted)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rate", "channels"), [pytest.param(200_000, 1, id="200 kS/s"), pytest.param(48_000, 2, id="two channels")]
)
def test_an_adc_and_a_dac_on_spis(rate: int, channels: int, tmp_path: Path) -> None:
    """12 bits at the clock of a ULX3S, through a filter that takes a sample every clock."""
    narrow = {"bits": 12, "signed": True, "range": [-1.0, 1.0]}
    spec = SPEC | {
        "sample_rate": rate,
        "channels": channels,
        "input": {"x": narrow},
        "output": narrow,
        "converter": {"x": {"device": "ad7476a", "range": [-1.0, 1.0]}, "output": {"device": "mcp4921"}},
        "hardware": {"clock": 25e6, "architecture": "parallel"},
    }
    made = sosmith.design(spec)
    netlist = build(made.core, tmp_path)
    codes = signal(channels, 12)
    assert np.array_equal(netlist.play(codes), expected(made, netlist, codes))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("baud", "channels", "bits", "packed", "is_enough"),
    [
        pytest.param(3_000_000, 1, 16, False, True, id="one at 3 Mbaud"),
        pytest.param(3_000_000, 2, 16, True, True, id="two at 3 Mbaud"),
        pytest.param(3_000_000, 2, 24, False, False, id="two of 24 bits at 3 Mbaud"),
        pytest.param(6_000_000, 2, 24, False, True, id="two of 24 bits at 6 Mbaud"),
    ],
)
def test_results_over_the_link_in_simulated_time(
    baud: int, channels: int, bits: int, packed: bool, is_enough: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A host that always has a request under way: the board's time stands still until it sends the next one."""
    monkeypatch.setattr(session, "_LONGEST", PATIENCE)
    monkeypatch.setattr(session, "_SHORTEST", PATIENCE)
    wide = {"bits": bits, "signed": True, "range": [-1.0, 1.0]}
    board = BOARDS["ulx3s_25f"]
    design = sosmith.design(SPEC | {"channels": channels, "input": {"x": wide}, "output": wide}).core
    netlist = build(design, tmp_path, clock=wiring_of(design, board).clock(board), baud=baud)
    ours, theirs = socket.socketpair()
    codes = signal(channels, bits)
    results: list[tuple[int, int]] = []
    with netlist.at(theirs.fileno(), wait=2_000, codes=codes):
        theirs.close()
        with Board.on(SocketLine(ours)) as host:
            assert (host.identity.packed is not None) is packed
            list(host.poll_all(256))  # what was kept, and overwritten, until here
            host.counters()  # from here on they count
            for _, found in host.poll_all(FRAMES // 2 * channels):
                results += zip(found.codes.tolist(), found.status.tolist(), strict=True)
            missed = host.counters()["missed"]
    assert (missed == 0) is is_enough
    assert netlist.schedule is not None
    fed = fed_codes(netlist.schedule, codes)
    computed = (design.datapath.compute(fed), design.datapath.compute_status(fed))
    wanted = list(zip(*(each.reshape(-1).tolist() for each in computed), strict=True))
    assert any(status for _, status in wanted)
    start = next(k for k in range(len(wanted)) if wanted[k : k + 8] == results[:8])
    assert (wanted[start : start + len(results)] == results[: len(wanted) - start]) is is_enough
