"""Runs inside the simulator: samples stream through a core while sets of constants are loaded into it.

Reads ``job.json`` of the folder named by RELOAD_BENCH: ``words`` of the input stream, ``dests`` (their channels; empty
if there is one channel only), ``loads`` (each a list of register writes [address, data], and whether it is right),
``seed``, ``behind`` (whether the core with the sets stands behind a decimator, whose samples count), and for a stage of
a chain ``chain``: the prefix of its ``registers``, their instance ``port``, its ``core``, and the nets that say that it
takes a sample. Writes
``outcome.json``: ``received`` (pairs of channel and word), ``swaps`` (number of swaps before each sample that was
taken), ``accepted`` (numbers of the loads in the order in which they were accepted), ``refused`` (those whose last
write was refused).
"""

import json
import os
import random
from pathlib import Path
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge, ValueChange

OKAY, SLVERR = 0, 2


class Bench:
    def __init__(self, dut: Any, job: dict[str, Any]) -> None:
        self.dut, self.job = dut, job
        chain = job.get("chain", {})
        self.core = getattr(dut, chain["core"]) if chain else dut.behind if job["behind"] else dut
        self.port = getattr(dut, chain["port"]).reload_port if chain else self.core.reload_port
        self.registers = chain.get("registers", "s_axil")
        self.taken_by = [getattr(dut, net) for net in chain.get("taken", [])]
        self.pace = random.Random(job["seed"])
        self.falling = FallingEdge(dut.aclk)
        self.swaps = 0
        self.loading = True
        self.used: list[int] = []
        self.taken = 0
        self.received: list[tuple[int, int]] = []
        self.accepted: list[int] = []
        self.refused: list[int] = []

    async def count_swaps(self) -> None:
        while True:
            await ValueChange(self.port.bank)
            self.swaps += 1

    def swaps_before_sample(self) -> int:
        """Count the swaps before the sample that is taken now; a folded core has chosen its bank some clocks before."""
        if not self.job["folded"]:
            return self.swaps
        return self.swaps - (int(self.core.bank.value) != self.swaps % 2)

    async def send(self) -> None:
        dut, number = self.dut, 0
        words = self.job["words"]
        await RisingEdge(dut.aclk)
        while self.loading or number % len(words):
            dut.s_axis_tdata.value = words[number % len(words)]
            if self.job["dests"]:
                dut.s_axis_tdest.value = self.job["dests"][number % len(words)]
            dut.s_axis_tvalid.value = 1
            while True:
                await self.falling  # outputs have settled, and the next edge takes what they say
                if int(dut.s_axis_tready.value):
                    break
                if self.job["folded"]:
                    await RisingEdge(dut.s_axis_tready)
            if not self.job["behind"] and not self.taken_by:
                self.used.append(self.swaps_before_sample())
            await RisingEdge(dut.aclk)
            number += 1
            self.taken = number
            if self.pace.random() < 0.3:
                dut.s_axis_tvalid.value = 0
                await ClockCycles(dut.aclk, self.pace.randrange(1, 30))
        dut.s_axis_tvalid.value = 0

    async def watch(self) -> None:
        names = (("s_axis_tready", "advance"), ("s_axis_tvalid", "i_valid"))  # ports of a core, or of its buffer
        ready, valid = self.taken_by or (
            next(getattr(self.core, name) for name in each if hasattr(self.core, name)) for each in names
        )
        while True:
            await self.falling
            if int(valid.value) and int(ready.value):
                self.used.append(self.swaps_before_sample())

    async def receive(self) -> None:
        dut = self.dut
        while True:
            if not int(dut.m_axis_tvalid.value):
                await RisingEdge(dut.m_axis_tvalid)
            await self.falling
            ready = self.pace.random() < 0.5
            dut.m_axis_tready.value = int(ready)
            if not ready:
                await ClockCycles(dut.aclk, self.pace.randrange(1, 12))
                continue
            dest = int(dut.m_axis_tdest.value) if self.job["dests"] else 0
            self.received.append((dest, int(dut.m_axis_tdata.value)))
            await RisingEdge(dut.aclk)
            await self.falling
            dut.m_axis_tready.value = 0

    def pin(self, signal: str) -> Any:
        """Return a signal of the registers."""
        return getattr(self.dut, f"{self.registers}_{signal}")

    async def write(self, address: int, data: int) -> int:
        await self.falling
        for signal, value in (("awaddr", address), ("wdata", data), ("wstrb", 15)):
            self.pin(signal).value = value
        for signal in ("awvalid", "wvalid", "bready"):
            self.pin(signal).value = 1
        waiting = {"awready": self.pin("awvalid"), "wready": self.pin("wvalid")}
        while True:
            taken = [name for name in waiting if int(self.pin(name).value)]
            answered = int(self.pin("bvalid").value)
            response = int(self.pin("bresp").value) if answered else 0
            if not taken and not answered and not waiting:
                await RisingEdge(self.pin("bvalid"))
                await self.falling
                continue
            await self.falling
            for name in taken:
                waiting.pop(name).value = 0
            if answered:
                self.pin("bready").value = 0
                return response

    async def load(self) -> None:
        for number, (writes, right) in enumerate(self.job["loads"]):
            await ClockCycles(self.dut.aclk, self.pace.randrange(1, 200))
            (first, version), *middle, (last, crc) = writes
            while await self.write(first, version) != OKAY:  # a swap is pending or a sample still uses the other bank
                await ClockCycles(self.dut.aclk, self.pace.randrange(1, 50))
            for address, data in middle:
                assert await self.write(address, data) == OKAY
            response = await self.write(last, crc)
            (self.accepted if response == OKAY else self.refused).append(number)
            assert (response == OKAY) == right
        await ClockCycles(self.dut.aclk, 5)
        self.loading = False


@cocotb.test()
async def reloading(dut: Any) -> None:
    folder = Path(os.environ["RELOAD_BENCH"])
    bench = Bench(dut, json.loads((folder / "job.json").read_text()))
    Clock(dut.aclk, 10, "ns", impl="gpi").start(start_high=False)
    for name in ("s_axis_tvalid", "m_axis_tready"):
        getattr(dut, name).value = 0
    for name in ("awvalid", "wvalid", "arvalid", "bready", "rready", "araddr", "awprot", "arprot"):
        bench.pin(name).value = 0
    dut.aresetn.value = 0
    await ClockCycles(dut.aclk, 4)
    await FallingEdge(dut.aclk)
    dut.aresetn.value = 1
    cocotb.start_soon(bench.count_swaps())
    cocotb.start_soon(bench.receive())
    if bench.job["behind"] or bench.taken_by:
        cocotb.start_soon(bench.watch())
    loading = cocotb.start_soon(bench.load())
    await bench.send()
    await loading
    await ClockCycles(dut.aclk, 3000)
    names = ("received", "accepted", "refused")
    outcome = {name: getattr(bench, name) for name in names} | {"swaps": bench.used, "taken": bench.taken}
    (folder / "outcome.json").write_text(json.dumps(outcome))
