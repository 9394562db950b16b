"""Runs a whole core in Amaranth's own simulator, with random handshakes."""

from __future__ import annotations

import random
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from amaranth.hdl import ClockDomain, ClockSignal, Module
from amaranth.sim import Simulator

from sosmith.gen.architectures.architecture import Architecture
from sosmith.hdl.plan.streams import fields, width
from sosmith.model.dataflow.status import STATUS_BITS

_PATIENCE = 20_000
"""Clocks without a transfer after which the core counts as hung."""


class Result(NamedTuple):
    """An output beat: the channel, the code and the status."""

    channel: int
    code: int
    status: int


@dataclass(frozen=True, kw_only=True)
class Pace:
    """Shares of the clocks in which source and sink do not do their part.

    Attributes
    ----------
    idle : float
        Share in which the source has nothing to offer.
    stall : float
        Share in which the sink is not ready.
    withdraw : float
        Share in which the source breaks the rule of AXI4-Stream: it takes back an offer that was not accepted. The
        clock after, it may offer the same sample again.
    """

    idle: float = 0.3
    stall: float = 0.3
    withdraw: float = 0.0


def simulate(dut: Any, testbench: Callable[[Any], Awaitable[None]]) -> None:
    """Run a core with one testbench, in the clock domain `bench`."""
    m = Module()
    m.domains.bench = ClockDomain(reset_less=True)
    m.submodules.core = dut
    m.d.comb += dut.aclk.eq(ClockSignal("bench"))
    simulator = Simulator(m)
    simulator.add_clock(1e-6, domain="bench")
    simulator.add_testbench(testbench)
    simulator.run()


def run_core(
    architecture: Architecture,
    samples: Sequence[tuple[int, Sequence[int]]],
    pace: Pace,
    *,
    results: int | None = None,
) -> list[Result]:
    """Feed a core; return its output beats in their order.

    Parameters
    ----------
    architecture : Architecture
        The core.
    samples : sequence of (int, sequence of int)
        Channel and input codes of each sample, in the order in which they are offered; whole beats.
    pace : Pace
        Of the handshakes.
    results : int or None
        Number of output beats; None for as many as there are samples.
    """
    wanted = len(samples) if results is None else results
    dut: Any = architecture.component()
    ports, output = fields(architecture.datapath.inputs), architecture.datapath.output
    lanes, size = architecture.samples_per_clock, width(architecture.datapath.inputs)
    beats = [(samples[k][0], samples[k : k + lanes]) for k in range(0, len(samples), lanes)]
    chance = random.Random(1)
    found: list[Result] = []

    async def bench(ctx: Any) -> None:
        ctx.set(dut.aresetn, 0)
        await ctx.tick("bench").repeat(2)
        ctx.set(dut.aresetn, 1)
        taken, waited, offers = 0, 0, False
        while len(found) < wanted or taken < len(beats):
            offers = taken < len(beats) and chance.random() >= (pace.withdraw if offers else pace.idle)
            channel, beat = beats[taken] if offers else (chance.getrandbits(1), [(0, [0] * len(ports))])
            word = sum(
                (code & ((1 << field.padded) - 1)) << field.offset + size * lane
                for lane, (_, codes) in enumerate(beat)
                for field, code in zip(ports, codes, strict=True)
            )
            ctx.set(dut.s_axis_tvalid, offers)
            ctx.set(dut.s_axis_tdata, word)
            if architecture.channels > 1:
                ctx.set(dut.s_axis_tdest, channel)
            ctx.set(dut.m_axis_tready, chance.random() >= pace.stall)
            moved = False
            if offers and ctx.get(dut.s_axis_tready):
                taken, offers, moved = taken + 1, False, True
            if ctx.get(dut.m_axis_tvalid) and ctx.get(dut.m_axis_tready):
                channel = ctx.get(dut.m_axis_tdest) if architecture.channels > 1 else 0
                for lane in range(lanes):
                    code = ctx.get(dut.m_axis_tdata) >> 8 * output.bytes * lane & ((1 << output.bits) - 1)
                    code -= (output.signed and code >> (output.bits - 1)) << output.bits
                    status = ctx.get(dut.m_axis_tuser) >> STATUS_BITS * lane & ((1 << STATUS_BITS) - 1)
                    found.append(Result(channel, code, status))
                moved = True
            waited = 0 if moved else waited + 1
            assert waited < _PATIENCE, f"the core hangs after {len(found)} results"
            await ctx.tick("bench")

    simulate(dut, bench)
    return found
