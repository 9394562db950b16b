"""The pins of a core in a simulator under cocotb, and the cocotb test that runs the bench on them."""

from __future__ import annotations

import ctypes
import os
from pathlib import Path
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, First, RisingEdge, Timer
from cocotb.utils import get_sim_time

from sosmith.sim.stream.bench import run_in
from sosmith.sim.stream.pins import PERIOD_NS, SETTLE_NS


class CocotbPins:
    """The pins of the core `dut`; its clock is started.

    `library` is the simulator's own program: in Verilator the compiled loop is in there.
    """

    def __init__(self, dut: Any) -> None:
        self.library = ctypes.CDLL(None)
        self._dut = dut
        self._falling = FallingEdge(dut.aclk)
        dut.aclk.value = 0
        Clock(dut.aclk, PERIOD_NS, "ns", impl="gpi").start(start_high=False)

    def read(self, port: str) -> int | str:
        """Value of a port."""
        value = getattr(self._dut, port).value
        return int(value) if value.is_resolvable else str(value)

    def write(self, port: str, value: int) -> None:
        """Set an input."""
        getattr(self._dut, port).value = value

    async def clock(self) -> None:
        """Wait for the next falling edge."""
        await self._falling

    async def settle(self) -> None:
        """Wait until everything has followed the inputs."""
        await Timer(SETTLE_NS, "ns")

    async def busy(self, limit: int) -> int:
        """Sleep until the core accepts or offers something."""
        dut, before = self._dut, get_sim_time("ns")
        timer = Timer(limit * PERIOD_NS, "ns")
        await First(RisingEdge(dut.s_axis_tready), RisingEdge(dut.m_axis_tvalid), timer)
        await self._falling
        clocks: int = round((get_sim_time("ns") - before) / PERIOD_NS)
        return clocks


@cocotb.test()
async def core_under_test(dut: Any) -> None:
    """Run the bench in the folder named by SOSMITH_BENCH."""
    failure = await run_in(Path(os.environ["SOSMITH_BENCH"]), CocotbPins(dut))
    assert failure is None, failure
