"""A board with audio converters at its pins: what its DACs get equals the integer model's results, bit for bit."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import sosmith
from sosmith.gen.fpga.boards import BOARDS
from sosmith.gen.output.board_top import wiring_of
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
    return np.concatenate([np.zeros((LATENCY, codes.shape[1]), np.int64), words])


@pytest.mark.parametrize(
    "clock",
    [pytest.param("ulx3s_25f", id="ULX3S"), pytest.param(24_576_000, id="exact", marks=pytest.mark.slow)],
)
def test_stereo_at_48_khz_leaves_two_frames_later(made: sosmith.Design, clock: str | int, tmp_path: Path) -> None:
    """At the clock that a ULX3S makes, from the text that `sosmith build` takes."""
    rate = Fraction(clock) if isinstance(clock, int) else wiring_of(made.core, BOARDS[clock]).clock(BOARDS[clock])
    netlist = build(made.core, tmp_path, clock=rate)
    assert netlist.schedule is not None
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
