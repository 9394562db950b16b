"""FIR filters that decimate with a sample at each clock: when they are chosen, and how their multipliers take turns."""

from __future__ import annotations

from itertools import chain
from typing import Any

import pytest

import sosmith
from sosmith.gen.estimate.estimate import estimated
from sosmith.gen.fpga.boards import find_board
from sosmith.hdl.plan.decimating.polyphase import polyphase_plan

LINE = [0.3, 0.2, 0.15, 0.1, -0.15, 0.2, 0.3]


def specification(taps: list[float] = LINE, decimate: int = 3, **hardware: Any) -> sosmith.Specification:
    return sosmith.Specification.load(
        {
            "name": "down",
            "sample_rate": 1e6,
            "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
            "filter": {"taps": taps, "decimate": decimate},
            "output": {"bits": 12, "range": [-2.0, 2.0], "signed": True},
            "hardware": {"clock": 1e6, **hardware},
        }
    )


def test_it_is_chosen_where_a_ring_is_too_slow() -> None:
    made = sosmith.design(specification())
    assert made.architecture == "parallel"
    assert made.reasons["architecture"].endswith("; 2 multipliers for 4 products of a result, a sample a clock")
    assert sosmith.design(specification(clock=1e7)).architecture == "folded"


@pytest.mark.parametrize("factor", [2, 3, 5, 8, 64])
@pytest.mark.parametrize(
    "taps", [LINE, [0.5, 0.0, 0.25, 0.125], [0.25, 0.0, 0.5, 0.0, 0.25], [0.1 * k for k in range(1, 41)]]
)
def test_each_product_is_taken_once_by_a_sample_that_is_there(taps: list[float], factor: int) -> None:
    largest = max(taps)
    made = sosmith.design(specification([round(tap / largest / 4, 6) for tap in taps], factor, architecture="parallel"))
    plan = polyphase_plan(made.core.datapath)
    taken = [step for step in chain(*plan.by_phase) if step is not None]
    assert sorted(map(repr, taken)) == sorted(map(repr, plan.steps.steps))
    assert plan.multipliers == -(-len(plan.steps.steps) // factor)
    for phase, own in enumerate(plan.by_phase):
        assert len(own) == plan.multipliers
        for step in own:
            assert step is None or 0 <= step.first - phase < plan.length
            assert step is None or step.second is None or 0 <= step.second - phase < plan.length


def test_multipliers_that_are_too_few_are_told() -> None:
    made = sosmith.design(specification(architecture="parallel", multipliers=2))
    assert made.core.architecture.multiplier_blocks == 2
    sentence = r"hardware\.multipliers must be at least 2 for a sample at each clock, not 1$"
    with pytest.raises(sosmith.ShortfallError, match=sentence):
        sosmith.design(specification(architecture="parallel", multipliers=1))


def test_it_is_estimated_with_its_multipliers() -> None:
    """Synthesis for an ECP5 takes 427 LUT4 and 6 multipliers for 22 symmetric taps, decimated by 2."""
    half = [0.01 * (k + 1) for k in range(11)]
    made = sosmith.design(specification([round(tap, 3) for tap in (*half, *half[::-1])], 2, architecture="parallel"))
    found = estimated(made.core.architecture, find_board("ulx3s_25f"))
    assert found is not None
    assert found.multiplier_blocks == 6
    assert len(made.core.architecture.cost.multipliers) == 11  # each product counts, as of a program


def several(channels: int, taps: list[float] = LINE, decimate: int = 3, **hardware: Any) -> sosmith.Specification:
    tree = specification(taps, decimate).as_dict()
    return sosmith.Specification.load(tree | {"channels": channels, "sample_rate": 1e5, "hardware": hardware})


def test_several_channels_share_the_multipliers() -> None:
    made = sosmith.design(several(3, clock=3e5))
    assert made.architecture == "parallel"
    assert made.reasons["architecture"].endswith("; 2 multipliers for 4 products of a result, a sample a clock")
    architecture = made.core.architecture
    plan = architecture.plan
    assert architecture.latency_cycles == 1 + 2 * plan.fills * 3 + plan.clocks + plan.limits + 1
    assert (architecture.reset_cycles, architecture.cycles_per_sample) == (3, 1)
    assert sosmith.design(several(3, clock=1e7)).architecture == "folded"
    with pytest.raises(sosmith.ShortfallError, match=r"the parallel architecture takes 3 clocks for 3 samples: at a "):
        sosmith.design(several(3, clock=2.9e5, architecture="parallel"))


def test_memories_of_channels_are_estimated() -> None:
    """Synthesis for an ECP5 takes 523 LUT4, LUT RAM among them, and 626 flip-flops for four channels of 22 taps."""
    half = [0.01 * (k + 1) for k in range(11)]
    taps = [round(tap, 3) for tap in (*half, *half[::-1])]
    made = sosmith.design(several(4, taps, 2, clock=1e7, architecture="parallel"))
    found = estimated(made.core.architecture, find_board("ulx3s_25f"))
    assert found is not None
    assert (found.multiplier_blocks, found.memory_bits) == (6, 924)
    assert found.luts == pytest.approx(523, rel=0.15)
    assert found.flip_flops == pytest.approx(626, rel=0.15)
