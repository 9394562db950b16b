"""A testbench that may begin once more after a reset, and that looks for results nobody asked for at the end."""

from collections.abc import Awaitable, Callable
from typing import Any

from amaranth.hdl import ResetInserter, Signal
from amaranth.sim import Simulator


def simulate(
    dut: Any, send: Callable[[Any], Awaitable[None]], *, before: Callable[[Any], Awaitable[None]] | None, idle: int
) -> None:
    """Run `send`, after `before` and a reset if there is something; then `idle` clocks without a sample."""
    reset = Signal()

    async def bench(ctx: Any) -> None:
        if before is not None:
            await before(ctx)
            ctx.set(reset, 1)
            await ctx.tick()
            ctx.set(reset, 0)
        await send(ctx)
        ctx.set(dut.i_valid, 0)
        ctx.set(dut.o_ready, 1)
        for _ in range(idle):
            await ctx.tick()
            assert not ctx.get(dut.o_valid)

    simulator = Simulator(ResetInserter(reset)(dut))
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
