"""Runs inside a simulator: a reload port written and read by cocotbext-axi's AXI4-Lite manager."""

import itertools
import random
import zlib
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import RisingEdge
from cocotbext.axi import AxiLiteBus, AxiLiteMaster, AxiResp

from sosmith.model.reload.registers import CRC, DATA, DESIGN, ID, LAYOUT, MAGIC, STATUS, VERSION, Outcome

LOADS = 20


def pauses(seed: int) -> Any:
    """Random waits on one channel, in phases."""
    pace = random.Random(seed)
    while True:
        share = pace.choice((0.0, 0.3, 0.9))
        yield from (pace.random() < share for _ in range(50))


async def keep_banks(dut: Any, banks: list[list[int]]) -> None:
    """Do what the banks of a core do."""
    while True:
        await RisingEdge(dut.clk)
        if dut.write_enable.value:
            banks[1 - int(dut.bank.value)][int(dut.write_address.value)] = int(dut.write_data.value)


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def loads(dut: Any) -> None:
    """Load sets, right and wrong ones, and read everything back."""
    pace = random.Random(1)
    dut.rst.value = 1
    dut.may_swap.value = 1
    dut.shadow_free.value = 1
    Clock(dut.clk, 10, "ns").start()
    manager = AxiLiteMaster(AxiLiteBus.from_prefix(dut, "s_axil"), dut.clk, dut.rst)
    channels = (
        manager.write_if.aw_channel,
        manager.write_if.w_channel,
        manager.write_if.b_channel,
        manager.read_if.ar_channel,
        manager.read_if.r_channel,
    )
    for seed, channel in enumerate(channels):
        channel.set_pause_generator(pauses(seed))
    for _ in range(3):
        await RisingEdge(dut.clk)
    dut.rst.value = 0

    async def write(address: int, word: int) -> AxiResp:
        return (await manager.write(address, word.to_bytes(4, "little"))).resp

    async def read(address: int) -> int:
        result = await manager.read(address, 4)
        assert result.resp == AxiResp.OKAY
        return int.from_bytes(result.data, "little")

    assert await read(ID.address) == MAGIC
    layout, design = await read(LAYOUT.address), await read(DESIGN.address)
    depth = LAYOUT.field("WORDS").of(layout)
    assert (LAYOUT.field("INTERFACE").of(layout), depth, design) == (1, 6, 0x0BADCAFE)
    banks = [[0] * depth, [0] * depth]
    cocotb.start_soon(keep_banks(dut, banks))
    active, version = [0] * depth, 0
    for number in itertools.count():
        words, new = [pace.getrandbits(32) for _ in range(depth)], pace.getrandbits(32)
        crc = zlib.crc32(b"".join(word.to_bytes(4, "little") for word in (new, *words)))
        wrong = number % 4 == 3
        assert await write(VERSION.address, new) == AxiResp.OKAY
        for word in words:
            assert await write(DATA.address, word) == AxiResp.OKAY
        # Reads in between, all at once, disturb nothing.
        reads = [cocotb.start_soon(manager.read(register.address, 4)) for register in (STATUS, DATA, VERSION)]
        answers = [(await task).resp for task in reads]
        assert answers == [AxiResp.OKAY, AxiResp.SLVERR, AxiResp.OKAY]
        assert await read(CRC.address) == crc
        if number % 4 == 2:
            assert (await manager.write(CRC.address, b"\0\0")).resp == AxiResp.SLVERR  # half a word
            wrong = True
            assert STATUS.field("OUTCOME").of(await read(STATUS.address)) == Outcome.BROKEN_OFF
        assert await write(CRC.address, crc ^ wrong << 7) == (AxiResp.SLVERR if wrong else AxiResp.OKAY)
        while STATUS.field("PENDING").of(await read(STATUS.address)):
            pass
        if not wrong:
            active, version = words, new
        assert banks[int(dut.bank.value)] == active
        assert await read(VERSION.address) == version
        if number == LOADS:
            break
