"""Sections that share hardware: whole cores against the model, with random handshakes, for each number of clocks."""

from __future__ import annotations

import random
from dataclasses import replace
from functools import cache
from typing import Any

import pytest
from tests.hdl.core_bench import Pace, run_core

import sosmith
from sosmith.gen.architectures.multiplexed import Multiplexed
from sosmith.hdl.plan.sharing.sharing import MOST_CLOCKS

SAMPLES = 60
KINDS: dict[str, dict[str, Any]] = {
    "steady": {"order": 4},
    "from zero": {"order": 4, "start": "zero"},
    "with a section alone": {"order": 5, "realization": "df1"},
    "without a state at the output": {"order": 6, "realization": "delta"},
}


@cache
def made(kind: str) -> sosmith.Design:
    hardware = dict(KINDS[kind])
    order = hardware.pop("order")
    return sosmith.design(
        {
            "name": "shared",
            "sample_rate": 1000.0,
            "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
            "filter": {"family": "butterworth", "kind": "lowpass", "order": order, "cutoff": 50.0},
            "output": {"bits": 8, "range": [-1.0, 1.0], "signed": True, "max_error": 0.02},
            "hardware": {"architecture": "multiplexed", "realization": "df1_ef2", "clock": 1e6} | hardware,
        }
    )


def with_clocks(architecture: Multiplexed, clocks: int) -> Multiplexed:
    """Return the hardware with so many clocks a turn."""
    speeds = [10e6, *(float(mhz) * 1e6 for mhz in range(30, 200, 2)), 1e9]
    found = (replace(architecture, clock=speed) for speed in speeds)
    return next((each for each in found if each.plan.clocks == clocks), architecture)


@pytest.mark.parametrize("pace", [Pace(idle=0.0, stall=0.0), Pace(), Pace(withdraw=0.5)], ids=["fast", "any", "rude"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("clocks", [1, 2, 3])
def test_results_are_those_of_the_model(kind: str, clocks: int, pace: Pace) -> None:
    design = made(kind)
    architecture = design.core.architecture
    assert isinstance(architecture, Multiplexed)
    architecture = with_clocks(architecture, clocks)
    assert architecture.plan.clocks in {1, clocks} <= {*range(1, MOST_CLOCKS + 1)}
    codes = [random.Random(clocks).randint(-128, 127) for _ in range(SAMPLES)]
    wanted = design.run_codes(x=codes).ravel().tolist()
    results = run_core(architecture, [(0, [code]) for code in codes], pace)
    assert [result.code for result in results] == wanted


def test_turns_are_spread_as_the_clock_asks() -> None:
    architecture = made("steady").core.architecture
    assert isinstance(architecture, Multiplexed)
    assert {with_clocks(architecture, clocks).plan.clocks for clocks in (1, 2, 3)} == {1, 2, 3}
