"""Runs a core in Amaranth's own simulator, without stalls: samples in, results out, each with its clock."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from amaranth.hdl import ClockDomain, ClockSignal, Module, ResetSignal
from amaranth.sim import Simulator

from sosmith.hdl.cores.folded import FoldedCore
from sosmith.hdl.cores.parallel import Core
from sosmith.hdl.plan.streams import fields

_LONGEST = 2000  # clocks after which a sample counts as lost


class Result(NamedTuple):
    """What a core hands on, and how many clocks after the edge that found its sample."""

    channel: int
    code: int
    status: int
    clocks: int


def run(core: Core | FoldedCore, samples: Sequence[tuple[int, Sequence[int]]]) -> list[Result]:
    """Give a core one sample after the other, each when the result before has left it.

    Parameters
    ----------
    core : Core or FoldedCore
        Without constants to be loaded.
    samples : sequence of (int, sequence of int)
        Channel and one code for each input port.
    """
    dut: Any = core
    m = Module()
    m.domains.bench = ClockDomain()
    m.submodules.dut = dut
    m.d.comb += [dut.aclk.eq(ClockSignal("bench")), dut.aresetn.eq(~ResetSignal("bench")), dut.m_axis_tready.eq(1)]
    output = core.datapath.output
    results = []

    async def bench(ctx: Any) -> None:
        await ctx.tick("bench").repeat(_LONGEST)  # the memories are cleared
        for channel, codes in samples:
            ctx.set(dut.s_axis_tvalid, 1)
            ctx.set(dut.s_axis_tdata, sum(map(_placed, fields(core.datapath.inputs), codes)))
            if core.channels > 1:
                ctx.set(dut.s_axis_tdest, channel)
            clocks = 0
            while not ctx.get(dut.m_axis_tvalid):
                assert clocks < _LONGEST
                accepted = ctx.get(dut.s_axis_tready)
                await ctx.tick("bench")
                clocks += 1
                if accepted:
                    ctx.set(dut.s_axis_tvalid, 0)
            code = ctx.get(dut.m_axis_tdata) & ((1 << output.bits) - 1)
            code -= (code > output.highest) << output.bits
            found = ctx.get(dut.m_axis_tdest) if core.channels > 1 else 0
            results.append(Result(found, code, ctx.get(dut.m_axis_tuser), clocks))
            await ctx.tick("bench")

    simulator = Simulator(m)
    simulator.add_clock(1e-6, domain="bench")
    simulator.add_testbench(bench)
    simulator.run()
    return results


def _placed(field: Any, code: int) -> int:
    return (code & ((1 << field.padded) - 1)) << field.offset
