"""CIC filters of adders: when they are chosen, and what they are not for."""

from __future__ import annotations

import re
from typing import Any

import pytest

import sosmith
from sosmith.gen.estimate.estimate import estimated
from sosmith.gen.fpga.boards import find_board
from sosmith.hdl.plan.decimating.cic import cic_plan
from sosmith.model.dataflow.cic import impulse_response


def specification(taps: list[float], *, filter_: dict[str, Any] | None = None, **hardware: Any) -> Any:
    return sosmith.Specification.load(
        {
            "name": "down",
            "sample_rate": 1e6,
            "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
            "filter": {"taps": taps, "decimate": 4, **(filter_ or {})},
            "output": {"bits": 12, "range": [-1.0, 1.0], "signed": True, "max_error": 0.001},
            "hardware": {"clock": 1e6, **hardware},
        }
    )


MEANS = [tap / 16 for tap in (1, 2, 3, 4, 3, 2, 1)]
"""Two means of 4 samples in series."""


def test_it_is_chosen_for_a_cic_filter() -> None:
    made = sosmith.design(specification(MEANS))
    assert made.reasons["architecture"] == (
        "parallel: the smallest that keeps up; 2 integrators and as many combs of 12 bits, a sample a clock"
    )
    assert made.cycles_per_sample == 1
    plan = made.core.architecture.plan
    assert (plan.factor, plan.order, plan.width, plan.frac) == (4, 2, 12, 0)
    cost = made.core.architecture.cost
    assert (cost.multiplications, cost.adder_bits, cost.register_bits) == ((), 4 * 12, 6 * 12 + 12)


@pytest.mark.parametrize(
    ("taps", "filter_", "hardware"),
    [
        ([1 / 8, 2 / 8, 1 / 8], {}, {"clock": 1e7}),
        (MEANS, {}, {"clock": 1e7, "reload": True}),
        (MEANS, {}, {"clock": 1e7, "protect": "detect"}),
        (MEANS, {}, {"clock": 1e7, "architecture": "folded"}),
    ],
)
def test_a_ring_is_made_of_others(taps: list[float], filter_: dict[str, Any], hardware: dict[str, Any]) -> None:
    made = sosmith.design(specification(taps, filter_=filter_, **hardware))
    assert made.architecture == "folded"


@pytest.mark.parametrize("taps", [MEANS, [0.5, 0.25, 0.25]])
def test_results_are_held(taps: list[float]) -> None:
    made = sosmith.design(specification(taps, filter_={"hold": True}, architecture="parallel"))
    assert made.core.architecture.copies_per_result == 4
    assert made.cycles_per_sample == 1


def several(channels: int = 3, **hardware: Any) -> Any:
    tree = specification(MEANS).as_dict() | {"channels": channels, "sample_rate": 1e5, "hardware": hardware}
    return sosmith.Specification.load(tree)


def test_several_channels_have_memories() -> None:
    made = sosmith.design(several(clock=1e6, architecture="parallel"))
    assert made.reasons["architecture"] == (
        "parallel: asked for in the specification; 2 integrators and as many combs of 12 bits, a sample a clock"
    )
    architecture = made.core.architecture
    filled = 2 * 2 * 4  # the first sample of a channel, at every second clock
    assert (architecture.plan.clocks, architecture.latency_cycles) == (5, 1 + 5 + 1 + filled)
    assert (architecture.reset_cycles, architecture.cycles_per_sample) == (3, 1)
    found = estimated(architecture, find_board("ulx3s_25f"))
    assert found is not None
    assert found.memory_bits == 3 * (4 * 12 + 4)


def test_several_channels_have_adders_where_a_ring_is_too_slow_or_has_no_multiplier() -> None:
    assert sosmith.design(several(clock=1e7)).architecture == "folded"
    assert sosmith.design(several(clock=1e7, multipliers=0)).architecture == "parallel"
    quick = sosmith.design(several(clock=3e5))
    assert quick.architecture == "parallel"
    assert "the folded architecture takes 1" in quick.reasons["architecture"]
    with pytest.raises(sosmith.ShortfallError, match=r"the parallel architecture takes 4 clocks for 4 samples: at a "):
        sosmith.design(several(clock=2.9e5, architecture="parallel"))


@pytest.mark.parametrize(("channels", "start"), [(4, "steady"), (32, "steady"), (4, "zero")])
def test_memories_of_channels_are_estimated(channels: int, start: str) -> None:
    """Synthesis for an ECP5 takes 626 to 840 LUT4, and 442 to 641 flip-flops: LUT RAM has words for 16 channels."""
    order, factor = (4, 16) if channels == 4 else (3, 8)
    tree = several(channels, architecture="parallel", clock=48e6, start=start).as_dict()
    tree["filter"] |= {"taps": [tap / factor**order for tap in impulse_response(factor, order)], "decimate": factor}
    tree["input"]["x"]["bits"] = tree["output"]["bits"] = 16
    del tree["output"]["max_error"]
    found = estimated(sosmith.design(sosmith.Specification.load(tree)).core.architecture, find_board("ulx3s_25f"))
    assert found is not None
    luts, flip_flops = (640, 630) if channels == 4 else (840, 442)
    luts += 240 if start == "zero" else 0
    assert found.luts == pytest.approx(luts, rel=0.15)
    assert found.flip_flops == pytest.approx(flip_flops, rel=0.15)


def test_taps_must_be_exact() -> None:
    """0.1 is no whole number of any power of two."""
    taps = [0.1, 0.2, 0.3, 0.2, 0.1]
    with pytest.raises(sosmith.ShortfallError, match=r"the filter's taps must be whole numbers of up to 40 bits "):
        sosmith.design(specification(taps, filter_={"decimate": 3}, architecture="parallel"))
    made = sosmith.design(specification(taps, filter_={"decimate": 3}, clock=1e7))
    assert made.architecture == "folded"


@pytest.mark.parametrize(
    ("change", "beside"),
    [
        ({"protect": "detect"}, 'hardware.protect = "detect"'),
        ({"reload": True}, "hardware.reload = true"),
    ],
)
def test_nothing_takes_it_without_multipliers_beside_others(change: dict[str, Any], beside: str) -> None:
    """Adders take no such option, and a ring has a multiplier."""
    tree = specification(MEANS).as_dict() | {"hardware": {"clock": 1e7, "multipliers": 0, **change}}
    sentence = (
        f"specification: not yet available: hardware.multipliers must be 'auto' with {beside} and a CIC filter that "
        "decimates, not 0"
    )
    with pytest.raises(sosmith.SpecificationError, match=f"^{re.escape(sentence)}$"):
        sosmith.Specification.load(tree)


def test_other_datapaths_have_no_plan() -> None:
    other = sosmith.design(specification([0.25, 0.5, 0.125], clock=1e7)).core.datapath
    with pytest.raises(ValueError, match=r"^taps must be those of moving sums, times a power of two$"):
        cic_plan(other)
    tree = specification([0.25, 0.5, 0.125]).as_dict()
    del tree["filter"]["decimate"]
    plain = sosmith.design(sosmith.Specification.load(tree)).core.datapath
    with pytest.raises(ValueError, match=r"^stages must be an FIR filter and the output$"):
        cic_plan(plain)


def test_it_is_estimated_without_multipliers() -> None:
    """Synthesis for an ECP5 takes 243 LUT4 and 320 flip-flops for four means of 4 samples of 12 bits."""
    taps = [tap / 256 for tap in (1, 4, 10, 20, 31, 40, 44, 40, 31, 20, 10, 4, 1)]
    tree = specification(taps).as_dict()
    tree["input"]["x"]["bits"], tree["output"]["bits"] = 12, 16
    tree["output"]["max_error"] = 1e-4
    made = sosmith.design(sosmith.Specification.load(tree))
    found = estimated(made.core.architecture, find_board("ulx3s_25f"))
    assert found is not None
    assert (found.multiplier_blocks, found.memory_bits) == (0, 0)
    assert found.luts == pytest.approx(243, rel=0.15)
    assert found.flip_flops == pytest.approx(320, rel=0.15)
