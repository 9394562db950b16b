# amaranth: UnusedElaboratable=no
"""Decimated cores of several channels in Amaranth's own simulator: the model of each, in every architecture."""

from dataclasses import replace

import numpy as np
import pytest
from tests.gen.word_lengths.decimated import small
from tests.hdl.core_bench import Pace, run_core
from tests.hdl.test_ahead import LIMITS

from sosmith.gen.architecture import Architecture

CHANNELS = 3


def made_in(name: str, before: str = "", *, core: str = "instrument", hold: bool = False) -> Architecture:
    """Return the small core for some channels, with measurements of a calibration, which may be in another one."""
    extra = "channels = {}\n[hardware]\narchitecture = '{}'\n".format
    made = small(extra(CHANNELS, name), core).architecture
    if core == "filter":
        return made
    other = small(extra(CHANNELS, before or name), core).architecture.ahead
    assert other is not None
    ahead = replace(other, datapath=replace(other.datapath, calibrated=LIMITS))
    return replace(
        made, datapath=replace(made.datapath, calibrated=LIMITS, ahead=ahead.datapath), ahead=ahead, hold=hold
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
    assert run_core(made, samples, Pace(), results=len(wanted)) == wanted
