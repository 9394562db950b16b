# amaranth: UnusedElaboratable=no
"""The decimator of many channels in Amaranth's own simulator: the model of each, at any pace, and after a reset."""

import random
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from tests.formal.prover import broken
from tests.hdl.decimation.decimators import decimator
from tests.hdl.decimation.restarted import simulate

from sosmith.hdl.decimation import channel_decimator as hardware
from sosmith.hdl.plan.decimator_clocks import cycles_per_result_of_many, latency_cycles, reset_cycles
from sosmith.model.dataflow.decimator import Decimator

Sample = tuple[int, int, int]
"""Channel, code and flags."""


@dataclass
class Seen:
    """Results, and the clocks since a reset at which samples were accepted and results left."""

    results: list[Sample] = field(default_factory=list)
    accepted: list[int] = field(default_factory=list)
    left: list[int] = field(default_factory=list)


def samples_for(made: Decimator, channels: int, count: int, *, flags: bool = False) -> list[Sample]:
    """Return samples of channels in any order, the last half of them at the upper end."""
    rng = np.random.default_rng(count)
    codes = rng.integers(made.input.lowest, made.input.highest + 1, count)
    codes[count // 2 :] = made.input.highest
    dest = rng.integers(0, channels, count)
    told = rng.integers(0, 4, count) * (rng.random(count) < 0.2) * flags
    return list(zip(dest.tolist(), codes.tolist(), told.tolist(), strict=True))


def expected(made: Decimator, samples: list[Sample], channels: int, *, flags: bool = False) -> list[Sample]:
    """Return the results in the order of the samples that complete them."""
    queues: list[list[Sample]] = []
    for channel in range(channels):
        own = np.array([[code, told] for dest, code, told in samples if dest == channel], dtype=np.int64).reshape(-1, 2)
        codes = made.compute(own[:, 0])
        found = made.gathered(own[:, 1].astype(np.uint8)) if flags else made.at_rail(own[:, 0])
        queues.append([(channel, code, int(told)) for code, told in zip(codes.tolist(), found.tolist(), strict=True)])
    results, counts = [], [0] * channels
    for dest, _, _ in samples:
        if dest < channels:
            if counts[dest] % made.factor == 0:
                results.append(queues[dest].pop(0))
            counts[dest] += 1
    return results


def run(
    made: Decimator,
    samples: list[Sample],
    channels: int,
    wanted: int,
    *,
    pace: tuple[float, float] = (1.0, 1.0),
    flags: bool = False,
    restart: int = 0,
    module: Any = hardware,
) -> Seen:
    """Send samples at a pace, after a reset in which the first `restart` of them have gone in."""
    dut: Any = module.ChannelDecimator(made, channels, 2 * flags)
    chance = random.Random(f"{pace}")
    seen = Seen()
    valid, ready = pace

    async def send(ctx: Any, samples: list[Sample], wanted: int) -> None:
        clock, offered, held = 0, False, None
        while len(seen.accepted) < len(samples) or len(seen.results) < wanted:
            sent = len(seen.accepted)
            offered = offered or (sent < len(samples) and chance.random() < valid)
            take = chance.random() < ready
            before = ctx.get(dut.i_ready), ctx.get(dut.o_valid)
            dest, code, told = samples[min(sent, len(samples) - 1)]
            ctx.set(dut.i_valid, offered)
            ctx.set(dut.i_data, code & ((1 << len(dut.i_data)) - 1))
            ctx.set(dut.i_dest, dest)
            if flags:
                ctx.set(dut.i_flags, told)
            ctx.set(dut.o_ready, take)
            assert (ctx.get(dut.i_ready), ctx.get(dut.o_valid)) == before
            found = ctx.get(dut.o_dest), ctx.get(dut.o_data), ctx.get(dut.o_flags)
            assert held is None or (before[1] and found == held)
            held = found if before[1] and not take else None
            if before[1] and take:
                code = found[1] - (found[1] > made.output.highest) * (1 << made.output.bits)
                seen.results.append((found[0], code, found[2]))
                seen.left.append(clock)
            if offered and before[0]:
                seen.accepted.append(clock)
                offered = False
            await ctx.tick()
            clock += 1
            assert clock < 20_000

    async def before(ctx: Any) -> None:
        await send(ctx, samples[:restart], 0)
        for kept in (seen.results, seen.accepted, seen.left):
            kept.clear()

    simulate(dut, lambda ctx: send(ctx, samples, wanted), before=before if restart else None, idle=20)
    return seen


@pytest.mark.sweep(5)
@pytest.mark.parametrize("signed", [True, False])
@pytest.mark.parametrize("flags", [True, False])
@pytest.mark.parametrize(
    ("factor", "stages", "dropped", "channels"), [(2, 1, 0, 2), (2, 4, 3, 3), (4, 3, 6, 5), (16, 2, 1, 2)]
)
def test_results_equal_the_model(
    factor: int, stages: int, dropped: int, channels: int, flags: bool, signed: bool
) -> None:
    made = decimator(factor, stages, dropped, signed=signed)
    samples = samples_for(made, channels + 1, 20 * factor * channels, flags=flags)  # one channel does not exist
    wanted = expected(made, samples, channels, flags=flags)
    seen = run(made, samples, channels, len(wanted), pace=(0.7, 0.3), flags=flags)
    assert seen.results == wanted


@pytest.mark.parametrize("steady", [True, False])
def test_nothing_before_a_reset_counts(steady: bool) -> None:
    made = decimator(4, 3, 2, steady=steady)
    samples = samples_for(made, 3, 161)
    wanted = expected(made, samples, 3)
    assert run(made, samples, 3, len(wanted), pace=(0.8, 0.8), restart=54).results == wanted


@pytest.mark.parametrize(("factor", "stages"), [(2, 3), (16, 2)])
def test_its_clocks_are_those_stated(factor: int, stages: int) -> None:
    made = decimator(factor, stages, 0)
    samples = [(0, code, 0) for _, code, _ in samples_for(made, 1, 20 * factor + 1)]
    seen = run(made, samples, 4, 21)
    assert seen.accepted[0] == reset_cycles(made, 4)
    completing = seen.accepted[::factor]
    assert {left - accepted for left, accepted in zip(seen.left, completing, strict=True)} == {latency_cycles(made, 4)}
    assert {later - earlier for earlier, later in pairwise(seen.left)} == {cycles_per_result_of_many(made)}


BROKEN = [
    ("a channel that stays as it was", "state.eq(Mux(started, word.data, 0))", "state.eq(word.data)"),
    ("no first sample", "(extended(self._code(kept.first), cic.width) << cic.growth)[: cic.width]", "0"),
    ("flags that stay", "Mux(kept.completes, 0, kept.flags | gathered)", "kept.flags | gathered"),
    ("a comb of another delay", "Mux(combing, acc, total)", "total"),
    ("a result overwritten", "with m.If(gives & (~self.o_valid | self.o_ready)):", "with m.If(gives):"),
    ("one state for all", "write.addr.eq(Cat(step, channel))", "write.addr.eq(step)"),
    ("a channel more", "(self.i_dest < self.channels)", "1"),
]


@pytest.mark.sweep(1)
@pytest.mark.parametrize(("right", "wrong"), [pytest.param(*case, id=subject) for subject, *case in BROKEN])
def test_what_is_broken_is_found(right: str, wrong: str) -> None:
    made = decimator(4, 3, 6)
    samples = samples_for(made, 4, 200)
    wanted = expected(made, samples, 3)
    options: dict[str, Any] = {"pace": (0.7, 0.05), "restart": 40}
    assert run(made, samples, 3, len(wanted), **options).results == wanted
    try:
        seen = run(made, samples, 3, len(wanted), module=broken(hardware, right, wrong), **options)
    except AssertionError:
        return
    assert seen.results != wanted
