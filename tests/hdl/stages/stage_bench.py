"""Runs a stage in Amaranth's own simulator."""

import random
from typing import Any

from amaranth.sim import Simulator

from sosmith.hdl.stages.pipelined import PipelinedStage
from sosmith.model.dataflow.structure import Stage


def run(stage: Stage, samples: list[list[int]], seed: int) -> list[list[int]]:
    """Return the outputs of the hardware with random bubbles and stalls."""
    dut: Any = PipelinedStage(stage)
    pace = random.Random(seed)
    results: list[list[int]] = []

    async def bench(ctx: Any) -> None:
        pending = list(samples)
        while len(results) < len(samples):
            valid, advance = pace.random() < 0.7 and bool(pending), pace.random() < 0.7
            ctx.set(dut.i_valid, valid)
            ctx.set(dut.advance, advance)
            for k, code in enumerate(pending[0] if valid else [0] * len(stage.graph.inputs)):
                ctx.set(getattr(dut, f"i{k}"), code)
            taken = ctx.get(dut.o_valid) and advance
            if taken:
                results.append([ctx.get(getattr(dut, f"o{k}")) for k in range(len(stage.graph.outputs))])
            if valid and advance:
                pending.pop(0)
            await ctx.tick()

    simulator = Simulator(dut)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    return results
