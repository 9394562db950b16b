# amaranth: UnusedElaboratable=no
"""Decimated instruments in Amaranth's own simulator: the model at any pace, after resets, at the clocks stated."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from tests.formal.prover import broken
from tests.gen.word_lengths.decimated import small
from tests.hdl.core_bench import Pace
from tests.hdl.decimation.calibrated import LIMITS, run

from sosmith.gen.architectures.architecture import Architecture
from sosmith.hdl.decimation import decimator as hardware
from sosmith.hdl.plan import folded_clocks

ARCHITECTURES = ("parallel", "folded", "serial")


@cache
def made_in(name: str, before: str = "", *, hold: bool = False) -> Architecture:
    """Return the small instrument, with measurements of its calibration, which may have another architecture."""
    made = small(f"[hardware]\narchitecture = '{name}'\n").architecture
    other = small(f"[hardware]\narchitecture = '{before or name}'\n").architecture.calibration
    assert other is not None
    ahead = replace(other, datapath=replace(other.datapath, calibrated=LIMITS))
    return replace(
        made,
        datapath=replace(made.datapath, calibrated=LIMITS, calibration=ahead.datapath),
        calibration=ahead,
        hold=hold,
    )


def codes_for(count: int) -> np.ndarray:
    """Return codes with a few at a rail or outside the calibration, and a constant at the end."""
    rng = np.random.default_rng(count)
    codes = rng.integers(100, 900, (count, 2))
    for number in rng.integers(0, count, count // 6):
        codes[number, rng.integers(2)] = rng.choice([0, 1023, 5, 1015])
    codes[-count // 5 :] = [512, 700]
    return codes


def expected(made: Architecture, codes: np.ndarray) -> list[tuple[int, int]]:
    datapath = made.datapath
    once = zip(datapath.compute(codes).tolist(), datapath.compute_status(codes).tolist(), strict=True)
    return [result for result in once for _ in range(made.copies_per_result)]


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("name", "before"), [*((name, name) for name in ARCHITECTURES), ("folded", "parallel"), ("parallel", "folded")]
)
def test_results_equal_the_model(name: str, before: str) -> None:
    made, codes = made_in(name, before), codes_for(38 if name == "serial" else 66)
    wanted = expected(made, codes)
    assert {status & 3 for _, status in wanted} == {0, 2, 3}
    assert run(made, codes, Pace(idle=0.3, stall=0.4)).results == wanted


@pytest.mark.sweep(1)
@pytest.mark.parametrize("name", ["parallel", "folded"])
def test_held_results_equal_the_model(name: str) -> None:
    made, codes = made_in(name, hold=True), codes_for(61)
    assert run(made, codes, Pace()).results == expected(made, codes)


@pytest.mark.sweep(2)
@pytest.mark.parametrize(
    ("name", "restart"), [("parallel", 1), ("parallel", 18), ("folded", 1), ("folded", 18), ("serial", 7)]
)
def test_nothing_before_a_reset_counts(name: str, restart: int) -> None:
    made, codes = made_in(name), codes_for(30)
    assert run(made, codes, Pace(idle=0.2, stall=0.2), restart=restart).results == expected(made, codes)


@pytest.mark.sweep(2)
@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize(
    ("name", "before"), [("parallel", "parallel"), ("folded", "folded"), ("folded", "parallel"), ("parallel", "folded")]
)
def test_its_clocks_are_those_stated(name: str, before: str, hold: bool) -> None:
    """Without a stall: the first sample, the rate, and, of samples at an even rate, how long a result takes."""
    made = made_in(name, before, hold=hold)
    assert made.decimator is not None
    seen = run(made, codes_for(61), Pace(idle=0, stall=0))
    assert seen.accepted[0] == made.reset_cycles
    first = seen.left[:: made.copies_per_result]
    assert [later - earlier for earlier, later in pairwise(first)][2:] == [made.cycles_per_result] * 13
    evenly = run(made, codes_for(61), Pace(idle=0, stall=0), every=made.cycles_per_sample)
    last = evenly.accepted[:: made.decimator.factor]
    waits = [left - accepted for left, accepted in zip(evenly.left[:: made.copies_per_result], last, strict=True)]
    assert waits[0] < min(waits[1:])  # the first sample has gone through the calibration before it is accepted
    # A folded calibration finds a sample some clocks before it accepts it.
    early = folded_clocks.FOLDED_DEPTH if before == "folded" else 0
    assert max(waits) == made.latency_cycles - early


@pytest.mark.slow
def test_a_serial_one_takes_no_longer_than_it_states() -> None:
    made = made_in("serial")
    seen = run(made, codes_for(25), Pace(idle=0, stall=0))
    assert 0.7 * made.reset_cycles < seen.accepted[0] <= made.reset_cycles
    apart = [later - earlier for earlier, later in pairwise(seen.left)]
    assert 0.7 * made.cycles_per_result < max(apart) <= made.cycles_per_result


BROKEN = [
    (
        "the flags of the last sample alone",
        'kept.load("found", found | self.i_flags)',
        'kept.load("found", self.i_flags)',
    ),
    ("flags that stay", 'kept.load("found", 0)', 'kept.load("found", found)'),
    ("the first sample twice", "self.s_axis_tvalid & (first | flows)", "self.s_axis_tvalid"),
    ("the first sample lost", "filled | (flows &", "filled | first | (flows &"),
    ("never filled", "fills.eq(0), filled.eq(1)", "fills.eq(0), filled.eq(0)"),
    ("no calibration's flags", "decimator.i_flags.eq(calibration.m_axis_tuser)", "decimator.i_flags.eq(0)"),
]


@pytest.mark.sweep(2)
@pytest.mark.parametrize(("right", "wrong"), [pytest.param(*case, id=subject) for subject, *case in BROKEN])
def test_what_is_broken_is_found(right: str, wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    made, codes = made_in("parallel"), codes_for(60)
    assert run(made, codes, Pace()).results == expected(made, codes)
    monkeypatch.setattr(hardware, "DecimatedCore", broken(hardware, right, wrong).DecimatedCore)
    assert run(made, codes, Pace()).results != expected(made, codes)
