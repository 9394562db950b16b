"""Cores with a calibration before the decimator, in simulation."""

import random
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from tests.hdl.core_bench import Pace, simulate

from sosmith.gen.architectures.architecture import Architecture
from sosmith.hdl.plan.streams import fields

LIMITS = ((10, 1000), (30, 1010))
"""Codes of voltage and temperature that the calibration's measurements covered."""


@dataclass
class Seen:
    """Results with their status, and clocks since a reset at which samples were accepted and results left."""

    results: list[tuple[int, int]] = field(default_factory=list)
    accepted: list[int] = field(default_factory=list)
    left: list[int] = field(default_factory=list)


def run(made: Architecture, codes: np.ndarray, pace: Pace, *, restart: int = 0, every: int = 1) -> Seen:
    """Feed a core, after a reset in which the first `restart` of the samples have gone in.

    The first sample apart, a sample is not offered before `every` clocks have passed since the one before.
    """
    dut: Any = made.component()
    ports, output = fields(made.datapath.inputs), made.datapath.output
    words = [sum(int(code) << f.offset for f, code in zip(ports, row, strict=True)) for row in codes]
    chance = random.Random(1)
    seen = Seen()

    async def feed(ctx: Any, samples: list[int], wanted: int) -> None:
        ctx.set(dut.aresetn, 0)
        await ctx.tick("bench").repeat(1)
        ctx.set(dut.aresetn, 1)
        offers, clock, held = False, 0, None
        while len(seen.accepted) < len(samples) or len(seen.results) < wanted:
            sent = len(seen.accepted)
            may = not sent or clock >= seen.accepted[-1] + every
            offers = sent < len(samples) and may and (offers or chance.random() >= pace.idle)
            takes = chance.random() >= pace.stall
            before = ctx.get(dut.s_axis_tready), ctx.get(dut.m_axis_tvalid)
            ctx.set(dut.s_axis_tvalid, offers)
            ctx.set(dut.s_axis_tdata, samples[min(sent, len(samples) - 1)])
            ctx.set(dut.m_axis_tready, takes)
            assert (ctx.get(dut.s_axis_tready), ctx.get(dut.m_axis_tvalid)) == before
            found = (ctx.get(dut.m_axis_tdata) & ((1 << output.bits) - 1), ctx.get(dut.m_axis_tuser))
            assert held is None or (before[1] and held == found)
            held = found if before[1] and not takes else None
            if before[1] and takes:
                seen.results.append(found)
                seen.left.append(clock)
            if offers and before[0]:
                seen.accepted.append(clock)
                offers = False
            await ctx.tick("bench")
            clock += 1
            assert clock < 60_000

    async def bench(ctx: Any) -> None:
        if restart:
            await feed(ctx, words[:restart], 0)
            for kept in (seen.results, seen.accepted, seen.left):
                kept.clear()
        await feed(ctx, words, made.datapath.results(len(words)) * made.copies_per_result)

    simulate(dut, bench)
    return seen
