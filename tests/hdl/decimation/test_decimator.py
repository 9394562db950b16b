# amaranth: UnusedElaboratable=no
"""The decimator in Amaranth's own simulator: equal to its model, at any pace, and after a reset in mid-run."""

import random
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from tests.hdl.decimation.decimators import decimator
from tests.hdl.decimation.restarted import simulate

from sosmith.hdl.decimation.decimator import CicDecimator
from sosmith.hdl.plan.decimator_clocks import cycles_per_result, latency_cycles, reset_cycles
from sosmith.model.dataflow.decimator import Decimator


def codes_for(made: Decimator, count: int, seed: int) -> list[int]:
    rng = np.random.default_rng(seed)
    codes = rng.integers(made.input.lowest, made.input.highest + 1, count)
    codes[count // 2 :] = made.input.highest
    return codes.tolist()


Run = tuple[list[tuple[int, int]], list[int], list[int]]
"""Results with their flags, and the clocks at which samples were accepted and results left."""


def run(made: Decimator, codes: list[int], *, valid: float = 1.0, ready: float = 1.0, restart: int = 0) -> Run:
    """Send `codes`, after a reset in which the first `restart` of them have gone in."""
    dut: Any = CicDecimator(made)
    pace = random.Random(f"{valid} {ready}")
    found: list[tuple[int, int]] = []
    accepted: list[int] = []
    left: list[int] = []
    mask = (1 << len(dut.i_data)) - 1

    async def send(ctx: Any, samples: list[int]) -> None:
        sent, clock = 0, 0
        offered = held = False
        while sent < len(samples) or len(left) < made.count(len(samples)):
            offered = offered or (sent < len(samples) and pace.random() < valid)
            take = pace.random() < ready
            before = ctx.get(dut.i_ready), ctx.get(dut.o_valid)
            ctx.set(dut.i_valid, offered)
            ctx.set(dut.i_data, samples[min(sent, len(samples) - 1)] & mask)
            ctx.set(dut.o_ready, take)
            assert (ctx.get(dut.i_ready), ctx.get(dut.o_valid)) == before
            assert not held or before[1]
            held = before[1] and not take
            if before[1] and take:
                code = ctx.get(dut.o_data)
                found.append((code - (code > made.output.highest) * (1 << made.output.bits), ctx.get(dut.o_rail)))
                left.append(clock)
            if offered and before[0]:
                accepted.append(clock)
                sent, offered = sent + 1, False
            await ctx.tick()
            clock += 1
            assert clock < 20_000

    async def before(ctx: Any) -> None:
        await send(ctx, codes[:restart])
        for kept in (found, accepted, left):
            kept.clear()

    simulate(dut, lambda ctx: send(ctx, codes), before=before if restart else None, idle=50)
    return found, accepted, left


def expected(made: Decimator, codes: list[int]) -> list[tuple[int, int]]:
    array = np.array(codes)
    return list(zip(made.compute(array).tolist(), made.at_rail(array).astype(int).tolist(), strict=True))


@pytest.mark.parametrize("signed", [True, False])
@pytest.mark.parametrize(("factor", "stages", "dropped"), [(2, 1, 0), (2, 4, 3), (4, 3, 6), (16, 2, 1)])
def test_results_equal_the_model(factor: int, stages: int, dropped: int, signed: bool) -> None:
    made = decimator(factor, stages, dropped, signed=signed)
    codes = codes_for(made, 30 * factor + 1, seed=factor)
    found, _, _ = run(made, codes, valid=0.7, ready=0.3)
    assert found == expected(made, codes)


@pytest.mark.parametrize("steady", [True, False])
def test_nothing_before_a_reset_counts(steady: bool) -> None:
    made = decimator(4, 3, 2, steady=steady)
    codes = codes_for(made, 161, seed=1)
    found, _, _ = run(made, codes, valid=0.8, ready=0.8, restart=54)
    assert found == expected(made, codes)


@pytest.mark.parametrize(("factor", "stages", "steady"), [(2, 3, True), (16, 2, True), (4, 2, False)])
def test_its_clocks_are_those_stated(factor: int, stages: int, steady: bool) -> None:
    made = decimator(factor, stages, 0, steady=steady)
    _, accepted, left = run(made, codes_for(made, 20 * factor + 1, seed=3))
    assert accepted[0] == reset_cycles(made)
    # A result leaves at the edge that ends the clock in which it was seen.
    assert left[0] - accepted[0] == latency_cycles(made)
    assert {later - earlier for earlier, later in pairwise(left)} == {cycles_per_result(made)}
