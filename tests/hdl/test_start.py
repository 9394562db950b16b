"""Cores that start from their first sample: equal to the integer model, channel by channel and reset by reset."""

import random
from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest
from tests.gen.word_lengths.filters import butterworth, plain
from tests.hdl.core_bench import Pace, run_core, simulate
from tests.hdl.stages.stage_bench import run

from sosmith.gen.architectures.registry import ARCHITECTURES
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.port import Port

X = Port.from_range("x", 6, Fraction(0), Fraction(2))


@cache
def datapath(realization: str = "df1_ef2") -> Datapath:
    made = plain(butterworth(2, 0.1), realization, X, Port.from_range("y", 8, Fraction(0), Fraction(2)), steady=True)
    return replace(made.datapath, name="core")


@pytest.mark.parametrize("realization", ["df1_ef2", "df2t", "normal"])
def test_a_value_passes_beside_every_pipeline_stage(realization: str) -> None:
    """With bubbles and stalls: it waits with its sample."""
    samples = [[code] for code in np.random.default_rng(1).integers(X.lowest, X.highest + 1, 80).tolist()]
    for number, stage in enumerate(datapath(realization).stages):
        expected = stage.graph.run(samples)
        assert run(stage, samples, number) == expected, stage.name
        samples = expected


@pytest.mark.sweep(2)
@pytest.mark.parametrize(
    ("architecture", "channels", "reload", "protect"),
    [
        ("parallel", 1, False, "none"),
        ("parallel", 3, False, "none"),
        ("folded", 3, False, "none"),
        ("serial", 1, False, "none"),
        ("parallel", 3, True, "correct"),
        ("parallel", 1, True, "detect"),
        ("folded", 1, True, "detect"),
    ],
)
def test_every_channel_starts_from_its_own_first_sample(
    architecture: str, channels: int, reload: bool, protect: str
) -> None:
    chance = random.Random(2)
    samples = [(chance.randrange(channels), [chance.randrange(64)]) for _ in range(30 * channels)]
    found = run_core(ARCHITECTURES[architecture](datapath(), channels, reload, protect), samples, Pace())
    for channel in range(channels):
        codes = np.array([codes for own, codes in samples if own == channel])
        results = [beat for beat in found if beat.channel == channel]
        assert [beat.code for beat in results] == datapath().compute_exact(codes)
        assert [beat.status for beat in results] == datapath().compute_status(codes).tolist()


@pytest.mark.parametrize("architecture", ["parallel", "folded"])
def test_every_reset_begins_with_a_new_first_sample(architecture: str) -> None:
    chance = random.Random(3)
    dut: Any = ARCHITECTURES[architecture](datapath()).component()
    runs = [[[chance.randrange(64)] for _ in range(chance.randint(1, 6))] for _ in range(12)]
    results: list[list[int]] = []

    async def bench(ctx: Any) -> None:
        ctx.set(dut.m_axis_tready, 1)
        for codes in runs:
            ctx.set(dut.aresetn, 0)
            await ctx.tick("bench").repeat(2)
            ctx.set(dut.aresetn, 1)
            taken, found = 0, list[int]()
            while len(found) < len(codes):
                ctx.set(dut.s_axis_tvalid, taken < len(codes))
                ctx.set(dut.s_axis_tdata, codes[min(taken, len(codes) - 1)][0])
                taken += ctx.get(dut.s_axis_tready) and taken < len(codes)
                if ctx.get(dut.m_axis_tvalid):
                    found.append(ctx.get(dut.m_axis_tdata))
                await ctx.tick("bench")
            results.append(found)

    simulate(dut, bench)
    assert results == [datapath().compute_exact(np.array(codes)) for codes in runs]
