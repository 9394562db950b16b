"""An AXI4-Lite manager for Amaranth's own simulator: random pace, and every rule that a slave can break is checked."""

import random
from collections.abc import Awaitable, Callable
from typing import Any

from amaranth.sim import Simulator

OKAY, SLVERR = 0, 2
_OUTPUTS = ("awready", "wready", "bvalid", "bresp", "arready", "rvalid", "rresp", "rdata")
_INPUTS = ("awvalid", "wvalid", "bready", "arvalid", "rready", "awaddr", "wdata", "wstrb", "araddr")
_LONGEST = 200  # clocks after which a transfer counts as hung


class Bus:
    """One manager of `dut`, which does one access after the other.

    Parameters
    ----------
    ctx : SimulatorContext
        Of a testbench.
    dut : Component
        With the members of a slave.
    pace : Random
        Of the handshakes.
    every_clock : callable
        Called before each rising edge.
    """

    def __init__(self, ctx: Any, dut: Any, pace: random.Random, every_clock: Callable[[], None] = lambda: None) -> None:
        self.ctx = ctx
        self.dut = dut
        self.pace = pace
        self.every_clock = every_clock
        self.clocks = 0
        self._held: dict[str, int] = {}

    def get(self, name: str) -> int:
        """Value of a signal of the bus."""
        return int(self.ctx.get(getattr(self.dut, f"s_axil_{name}")))

    def set(self, **values: int) -> None:
        """Set inputs of the bus."""
        for name, value in values.items():
            self.ctx.set(getattr(self.dut, f"s_axil_{name}"), value)

    async def clock(self) -> None:
        """Let one rising edge pass."""
        if self.pace.random() < 1 / 16:
            self._probe()
        self._check_stable()
        self.every_clock()
        self.clocks += 1
        await self.ctx.tick()

    def _outputs(self) -> list[int]:
        return [self.get(name) for name in _OUTPUTS]

    def _probe(self) -> None:
        """Check that no output follows an input within a clock."""
        before = self._outputs()
        held = {name: self.get(name) for name in _INPUTS}
        for _ in range(4):
            self.set(**{name: self.pace.getrandbits(32) & self._mask(name) for name in _INPUTS})
            assert self._outputs() == before
        self.set(**held)

    def _mask(self, name: str) -> int:
        return (1 << len(getattr(self.dut, f"s_axil_{name}"))) - 1

    def _check_stable(self) -> None:
        """Check that a response which was not taken is still there, and the same."""
        for valid, payload in (("bvalid", ("bresp",)), ("rvalid", ("rresp", "rdata"))):
            if valid in self._held:
                assert self.get(valid) == 1
                assert all(self.get(name) == self._held[name] for name in payload)
                del self._held[valid]
            if self.get(valid) and not self.get(valid.replace("valid", "ready")):
                self._held |= {name: self.get(name) for name in (valid, *payload)}

    async def idle(self, clocks: int) -> None:
        """Do nothing for some clocks."""
        for _ in range(clocks):
            await self.clock()

    async def write(self, address: int, data: int, strobe: int = 15) -> int:
        """Write, address and data in a random order; return the response."""
        waits = {
            "aw": self.pace.choice((0, 0, 3, 60)),
            "w": self.pace.choice((0, 0, 3, 60)),
            "b": self.pace.randrange(4),
        }
        self.set(awaddr=address, wdata=data, wstrb=strobe)
        sent: set[str] = set()
        for _ in range(_LONGEST):
            for channel in ("aw", "w"):
                offered = channel not in sent and waits[channel] == 0
                self.set(**{f"{channel}valid": offered})
                waits[channel] = max(0, waits[channel] - 1)
            ready = len(sent) == 2 and self.get("bvalid") and waits["b"] == 0
            early = self.pace.random() < 0.1  # a manager may be ready before there is a response
            self.set(bready=bool(ready) or early)
            assert len(sent) == 2 or not self.get("bvalid")
            taken = [c for c in ("aw", "w") if self.get(f"{c}valid") and self.get(f"{c}ready")]
            response = self.get("bresp") if self.get("bvalid") and self.get("bready") else None
            waits["b"] = max(0, waits["b"] - self.get("bvalid"))
            await self.clock()
            sent |= set(taken)
            if response is not None:
                self.set(bready=0, awvalid=0, wvalid=0)
                return response
        raise AssertionError(f"a write to {address:#x} must end within {_LONGEST} clocks")

    async def read(self, address: int) -> tuple[int, int]:
        """Read; return the data and the response."""
        wait = self.pace.randrange(4)
        self.set(araddr=address, arvalid=1)
        sent = False
        for _ in range(_LONGEST):
            self.set(rready=bool(self.get("rvalid") and wait == 0) or self.pace.random() < 0.1)
            assert sent or not self.get("rvalid")
            taken = self.get("arvalid") and self.get("arready")
            result = (self.get("rdata"), self.get("rresp")) if self.get("rvalid") and self.get("rready") else None
            wait = max(0, wait - self.get("rvalid"))
            await self.clock()
            if taken:
                sent = True
                self.set(arvalid=0)
            if result is not None:
                self.set(rready=0)
                return result
        raise AssertionError(f"a read of {address:#x} must end within {_LONGEST} clocks")


def run(dut: Any, testbench: Callable[[Any], Awaitable[None]]) -> None:
    """Run `dut` with one testbench."""
    simulator = Simulator(dut)
    simulator.add_clock(1e-6)
    simulator.add_testbench(testbench)
    simulator.run()
