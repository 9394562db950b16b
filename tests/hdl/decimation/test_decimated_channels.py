# amaranth: UnusedElaboratable=no
"""Decimated cores of several channels in Amaranth's own simulator: the model of each, in every architecture."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tests.formal.prover import broken
from tests.gen.word_lengths.decimated import small
from tests.hdl import core_bench
from tests.hdl.core_bench import Pace, run_core
from tests.hdl.decimation.calibrated import LIMITS, run

from sosmith.gen.architectures.architecture import Architecture
from sosmith.hdl.decimation import decimator as hardware
from sosmith.hdl.plan import folded_clocks

CHANNELS = 3


def made_in(name: str, before: str = "", *, core: str = "instrument", hold: bool = False) -> Architecture:
    """Return the small core for some channels, with measurements of a calibration, which may be in another one."""
    extra = "channels = {}\n[hardware]\narchitecture = '{}'\n".format
    made = small(extra(CHANNELS, name), core).architecture
    if core == "filter":
        return made
    other = small(extra(CHANNELS, before or name), core).architecture.calibration
    assert other is not None
    ahead = replace(other, datapath=replace(other.datapath, calibrated=LIMITS))
    return replace(
        made,
        datapath=replace(made.datapath, calibrated=LIMITS, calibration=ahead.datapath),
        calibration=ahead,
        hold=hold,
    )


def samples_for(made: Architecture, count: int) -> list[tuple[int, list[int]]]:
    """Return samples of channels in any order, a few at a rail or outside the calibration; one does not exist."""
    rng = np.random.default_rng(count)
    codes = rng.integers(100, 900, (count, len(made.datapath.inputs)))
    for number in rng.integers(0, count, count // 6):
        codes[number, rng.integers(codes.shape[1])] = rng.choice([0, 1023, 5, 1015])
    return list(zip(rng.integers(0, CHANNELS + 1, count).tolist(), codes.tolist(), strict=True))


def expected(made: Architecture, samples: list[tuple[int, list[int]]]) -> list[tuple[int, int, int]]:
    """Return the results in the order of the samples that complete them."""
    datapath, queues = made.datapath, []
    assert datapath.decimator is not None
    for channel in range(CHANNELS):
        codes = np.array([code for dest, code in samples if dest == channel])
        pairs = zip(datapath.compute(codes).tolist(), datapath.compute_status(codes).tolist(), strict=True)
        queues.append([(channel, code, status) for code, status in pairs])
    results, counts = [], [0] * CHANNELS
    for dest, _ in samples:
        if dest < CHANNELS:
            if counts[dest] % datapath.decimator.factor == 0:
                results += [queues[dest].pop(0)] * made.copies_per_result
            counts[dest] += 1
    return results


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "before", "core"),
    [
        ("parallel", "", "instrument"),
        ("folded", "", "instrument"),
        ("serial", "", "instrument"),
        ("folded", "parallel", "instrument"),
        ("parallel", "", "filter"),
        ("folded", "", "filter"),
    ],
)
@pytest.mark.parametrize("hold", [False, True])
def test_results_equal_the_model(name: str, before: str, core: str, hold: bool) -> None:
    made = replace(made_in(name, before, core=core), hold=hold)
    samples = samples_for(made, 60 if name == "serial" else 130)
    wanted = expected(made, samples)
    assert {status & 3 for _, _, status in wanted} >= {0, 1 if core == "filter" else 3}
    # So slow a sink that results wait in the core with their flags while the decimator has the next one.
    assert run_core(made, samples, Pace(idle=0.1, stall=0.9), results=len(wanted)) == wanted


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "before", "core"),
    [
        ("parallel", "", "instrument"),
        ("folded", "", "instrument"),
        ("parallel", "folded", "instrument"),
        ("folded", "", "filter"),
        ("parallel", "", "filter"),
    ],
)
def test_it_takes_no_longer_than_it_states(name: str, before: str, core: str) -> None:
    """One channel alone, as fast as it may and at an even rate."""
    made = made_in(name, before, core=core)
    assert made.decimator is not None
    codes = np.random.default_rng(1).integers(100, 900, (61, len(made.datapath.inputs)))
    seen = run(made, codes, Pace(idle=0, stall=0))
    assert [code for code, _ in seen.results] == made.datapath.compute(codes).tolist()
    # A folded core accepts a sample some clocks after it finds it.
    assert made.reset_cycles - 1 <= seen.accepted[0] <= made.reset_cycles + folded_clocks.FOLDED_DEPTH
    apart = [later - earlier for earlier, later in pairwise(seen.left)]
    assert 0.8 * made.cycles_per_result < max(apart) <= made.cycles_per_result
    evenly = run(made, codes, Pace(idle=0, stall=0), every=-(-made.cycles_per_result // made.decimator.factor))
    waits = [left - at for left, at in zip(evenly.left, evenly.accepted[:: made.decimator.factor], strict=True)]
    assert 0.8 * made.latency_cycles < max(waits) <= made.latency_cycles


BROKEN = [
    ("samples of one channel", "decimator.i_dest.eq(source)", "decimator.i_dest.eq(0)"),
    ("results of one channel", "core.s_axis_tdest.eq(decimator.o_dest)", "core.s_axis_tdest.eq(0)"),
    ("taken before memories are cleared", "ready & ~closed.any()", "ready"),
]


@pytest.mark.sweep(1)
@pytest.mark.parametrize(("right", "wrong"), [pytest.param(*case, id=subject) for subject, *case in BROKEN])
def test_what_is_broken_is_found(right: str, wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    made = made_in("folded", "parallel")
    samples = samples_for(made, 90)
    wanted = expected(made, samples)
    pace = Pace(idle=0.1, stall=0.2)
    assert run_core(made, samples, pace, results=len(wanted)) == wanted
    monkeypatch.setattr(core_bench, "_PATIENCE", 1000)
    monkeypatch.setattr(hardware, "DecimatedCore", broken(hardware, right, wrong).DecimatedCore)
    try:
        found = run_core(made, samples, pace, results=len(wanted))
    except AssertionError:  # it hangs
        return
    assert found != wanted
