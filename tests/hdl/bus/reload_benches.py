"""The reload port under a bench of its own."""

import random
import zlib
from collections.abc import Awaitable, Callable
from typing import Any

from amaranth.hdl import ResetInserter, Signal
from tests.hdl.bus.axi_lite_bench import OKAY, Bus, run

from sosmith.hdl.reload import ReloadPort
from sosmith.model.reload.registers import (
    CRC,
    DATA,
    STATUS,
    VERSION,
)

DEPTH = 3


def crc_of(version: int, words: list[int]) -> int:
    """CRC of a set, by another implementation."""
    return zlib.crc32(b"".join(word.to_bytes(4, "little") for word in (version, *words)))


class Bench:
    """A reload port with two banks behind it, and what must be true of them at every clock."""

    def __init__(self, ctx: Any, dut: Any, reset: Signal, seed: int) -> None:
        self.dut = dut
        self.ctx = ctx
        self.pace = random.Random(seed)
        self.bus = Bus(ctx, dut, self.pace, self.every_clock)
        self.banks: list[list[int | None]] = [[None] * dut.depth, [None] * dut.depth]
        self.swaps = 0
        self.gaps = 1.0  # share of the clocks in which the bank may change
        self._reset = reset
        self._expected = 0
        ctx.set(dut.shadow_free, 1)

    def every_clock(self) -> None:
        """Keep the banks, and check that the bank changes if and only if it was asked to and allowed to."""
        ctx, dut = self.ctx, self.dut
        bank = int(ctx.get(dut.bank))
        assert bank == self._expected
        ctx.set(dut.may_swap, self.pace.random() < self.gaps)
        swaps = bool(ctx.get(dut.pending) and ctx.get(dut.may_swap))
        self._expected ^= swaps
        self.swaps += swaps
        if ctx.get(dut.write_enable):
            address = int(ctx.get(dut.write_address))
            assert not ctx.get(dut.pending)
            assert address < dut.depth
            self.banks[1 - bank][address] = ctx.get(dut.write_data)

    @property
    def active(self) -> list[int | None]:
        """Words that samples would use now."""
        return self.banks[int(self.ctx.get(self.dut.bank))]

    async def reset(self) -> None:
        """Reset the port for one clock, whatever it is doing."""
        self.bus.set(awvalid=0, wvalid=0, arvalid=0)
        self.ctx.set(self._reset, 1)
        await self.ctx.tick()
        self.ctx.set(self._reset, 0)
        assert (self.bus.get("bvalid"), self.bus.get("rvalid")) == (0, 0)

    async def status(self) -> dict[str, int]:
        """Fields of the status."""
        word, response = await self.bus.read(STATUS.address)
        assert response == OKAY
        return {field.name: field.of(word) for field in STATUS.fields}

    async def version(self) -> int:
        """Version of the active set."""
        word, response = await self.bus.read(VERSION.address)
        assert response == OKAY
        return word

    async def load(self, version: int, words: list[int], *, crc: int | None = None) -> list[int]:
        """Load a set; return the responses."""
        write = self.bus.write
        responses = [await write(VERSION.address, version)]
        responses += [await write(DATA.address, word) for word in words]
        return [*responses, await write(CRC.address, crc_of(version, words) if crc is None else crc)]

    def words(self, count: int | None = None) -> list[int]:
        """Random words, with those among them that a CRC is easily wrong about."""
        hard = (0, 0xFFFFFFFF, 0x80000000, 1)
        count = self.dut.depth if count is None else count
        return [self.pace.choice((*hard, self.pace.getrandbits(32))) for _ in range(count)]


Scenario = Callable[[Bench], Awaitable[None]]


def benched(scenario: Scenario, depth: int = DEPTH, *, seed: int = 1, **options: Any) -> None:
    """Run a scenario on a port."""
    dut: Any = ReloadPort(depth, **options)
    reset = Signal()

    async def testbench(ctx: Any) -> None:
        await scenario(Bench(ctx, dut, reset, seed))

    run(ResetInserter(reset)(dut), testbench)
