"""Runs a folded or serial core in Amaranth's own simulator: at any pace, with resets, loads and upsets in mid-run."""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from amaranth.hdl import Module
from tests.hdl.bus.axi_lite_bench import OKAY

from sosmith.hdl.cores.folded import FoldedCore
from sosmith.hdl.plan.streams import fields
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.program import Program
from sosmith.model.dataflow.status import Flag

Sample = tuple[int, Sequence[int]]
"""Channel and one code for each input port."""

_PATIENCE = 5000
"""Clocks without a transfer after which the core counts as hung."""


class Result(NamedTuple):
    """What a core hands on: the channel, the code and the flags."""

    channel: int
    code: int
    status: int


class Model:
    """What programs make of samples, in exact integers, channel by channel from a reset on."""

    def __init__(self, datapath: Datapath, program: Program, channels: int) -> None:
        self._datapath = datapath
        self._words = [program.reset() for _ in range(channels)]

    def results(self, program: Program, samples: Iterable[Sample]) -> list[Result]:
        """Return the results of samples whose channel exists; the states are kept."""
        return [self._result(program, c, codes) for c, codes in samples if c < len(self._words)]

    def _result(self, program: Program, channel: int, codes: Sequence[int]) -> Result:
        made, inputs, output = self._datapath, self._datapath.inputs, self._datapath.output
        found = program.step(codes, self._words[channel], [0] * len(inputs))
        code = min(max(found.code, output.lowest), output.highest)
        holds = {
            Flag.INPUT_AT_RAIL: any(x in {port.lowest, port.highest} for x, port in zip(codes, inputs, strict=True)),
            Flag.OUTSIDE_CALIBRATION: found.outside,
            Flag.OUTPUT_SATURATED: code != found.code,
        }
        if made.wear:
            limits = made.wear[channel % len(made.wear)]
            holds |= {
                flag: code >= limit for flag, limit in zip((Flag.WEAR_WARNING, Flag.WEAR_CRITICAL), limits, strict=True)
            }
        return Result(channel, code, sum(1 << flag for flag, raised in holds.items() if raised))


class Line:
    """The streams of a core, a source and a sink, in the domain "bench".

    Parameters
    ----------
    ctx : SimulatorContext
        Of a testbench.
    dut : Probed
        The core.
    idle, stall : float
        Shares of the clocks in which the source offers nothing new, and in which the sink is not ready.
    """

    def __init__(self, ctx: Any, dut: Probed, idle: float = 0.0, stall: float = 0.0) -> None:
        self.ctx, self.dut, self.idle, self.stall = ctx, dut, idle, stall
        self.results: list[Result] = []
        self.clocks = 0
        self._ports = fields(dut.datapath.inputs)
        self._chance = random.Random(1)
        self._queue: list[Sample] = []
        self._offers = False
        self._held: tuple[int, ...] | None = None
        self._waited = 0
        ctx.set(dut.aresetn, 1)

    def step(self) -> None:
        """Set the inputs for this clock, and note what the next edge moves."""
        ctx, dut = self.ctx, self.dut
        self._offers = self._offers or (bool(self._queue) and self._chance.random() >= self.idle)
        channel, codes = self._queue[0] if self._offers else (self._chance.getrandbits(3), [0] * len(self._ports))
        masked = [(code & ((1 << f.padded) - 1)) << f.offset for f, code in zip(self._ports, codes, strict=True)]
        ctx.set(dut.s_axis_tvalid, self._offers)
        ctx.set(dut.s_axis_tdata, sum(masked))
        if dut.channels > 1:
            ctx.set(dut.s_axis_tdest, channel)
        ready = self._chance.random() >= self.stall
        ctx.set(dut.m_axis_tready, ready)
        self._waited += 1
        assert self._waited < _PATIENCE, f"the core hangs after {len(self.results)} results"
        if self._offers and ctx.get(dut.s_axis_tready):
            del self._queue[0]
            self._offers, self._waited = False, 0
        beat = self._beat()
        assert self._held is None or beat == self._held, "a result that waits must stay as it is"
        self._held = None if ready else beat
        if beat is not None and ready:
            output, (code, status, channel) = dut.datapath.output, beat
            code &= (1 << output.bits) - 1
            self.results.append(Result(channel, code - ((code > output.highest) << output.bits), status))
            self._waited = 0
        if not self._queue:
            self._waited = 0
        self.clocks += 1

    def _beat(self) -> tuple[int, ...] | None:
        """Code, status and channel at the output; None if there is no result."""
        dut = self.dut
        if not self.ctx.get(dut.m_axis_tvalid):
            return None
        dest = (dut.m_axis_tdest,) if dut.channels > 1 else ()
        found = [int(self.ctx.get(signal)) for signal in (dut.m_axis_tdata, dut.m_axis_tuser, *dest)]
        return (*found, *[0] * (3 - len(found)))

    @property
    def waiting(self) -> int:
        """Number of samples that have not been accepted."""
        return len(self._queue)

    def put(self, samples: Iterable[Sample]) -> None:
        """Have samples offered one after the other."""
        self._queue += samples

    async def wait(self, clocks: int) -> None:
        """Let some clocks pass."""
        for _ in range(clocks):
            self.step()
            await self.ctx.tick("bench")

    async def finish(self, count: int) -> list[Result]:
        """Return the next results, that many; then nothing more comes."""
        while len(self.results) < count or self._queue:
            await self.wait(1)
        await self.wait(3)
        assert len(self.results) == count
        found, self.results = self.results, []
        return found

    async def write(self, address: int, data: int) -> None:
        """Write a register, with no pause; samples go on meanwhile."""
        await self._access("b", awaddr=address, awvalid=1, wdata=data, wstrb=15, wvalid=1, bready=1)
        assert self.ctx.get(self.dut.s_axil_bresp) == OKAY
        await self.wait(1)

    async def read(self, address: int) -> int:
        """Read a register; samples go on meanwhile."""
        await self._access("r", araddr=address, arvalid=1, rready=1)
        assert self.ctx.get(self.dut.s_axil_rresp) == OKAY
        word = int(self.ctx.get(self.dut.s_axil_rdata))
        await self.wait(1)
        return word

    async def _access(self, answer: str, **inputs: int) -> None:
        """Set inputs of the register port, and wait for its answer."""
        for name, value in inputs.items():
            self.ctx.set(getattr(self.dut, f"s_axil_{name}"), value)
        while not self.ctx.get(getattr(self.dut, f"s_axil_{answer}valid")):
            sent = [n for n in inputs if n.endswith("valid") and self._takes(n.removesuffix("valid"))]
            await self.wait(1)
            for name in sent:
                self.ctx.set(getattr(self.dut, f"s_axil_{name}"), 0)

    def _takes(self, channel: str) -> bool:
        return bool(self.ctx.get(getattr(self.dut, f"s_axil_{channel}ready")))

    async def reset(self) -> None:
        """Reset the core for one clock, whatever it does; what was offered is forgotten."""
        self._queue, self._offers, self._held, self.results = [], False, None, []
        self.ctx.set(self.dut.s_axis_tvalid, 0)
        self.ctx.set(self.dut.aresetn, 0)
        await self.ctx.tick("bench")
        self.ctx.set(self.dut.aresetn, 1)
        assert not self.ctx.get(self.dut.m_axis_tvalid)


class Probed(FoldedCore):
    """A core whose memories can be looked into and damaged."""

    aclk: Any
    aresetn: Any
    s_axis_tvalid: Any
    s_axis_tready: Any
    s_axis_tdata: Any
    s_axis_tdest: Any
    m_axis_tvalid: Any
    m_axis_tready: Any
    m_axis_tdata: Any
    m_axis_tuser: Any
    m_axis_tdest: Any

    def elaborate(self, platform: object) -> Module:
        """Build it, and keep what was built."""
        self._built = super().elaborate(platform)
        return self._built

    def memory(self, name: str) -> Any:
        """Words of the memory of this name, which a testbench can read and set."""
        place = {"instructions": "program_memory", "wear_limits": "result"}.get(name, "word_memory")
        return self._built.submodules[place].submodules[name].data

    def reads_a_word(self, ctx: Any) -> bool:
        """Whether the memory of words is addressed where there is one: behind the last, simulators find an X."""
        words = self._built.submodules.word_memory.submodules.words0
        return all(ctx.get(port.addr) < words.depth for port in words.read_ports)

    def damage(self, ctx: Any, name: str, address: int, *bits: int) -> None:
        """Turn over some bits of a word."""
        word = self.memory(name)[address]
        ctx.set(word, ctx.get(word) ^ sum(1 << bit for bit in bits))
