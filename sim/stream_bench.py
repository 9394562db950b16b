"""The cocotb test that runs inside the simulator: feeds a core's streams, checks their rules, keeps the results.

Configuration and stimulus come from the folder named by SOSMITH_BENCH: ``bench.json`` and ``words.txt``;
``result.json`` and ``received.txt`` go there. The bench wakes once a clock, at the falling edge: there it reads
what the rising edge before has left, settled, and sets the inputs that the next rising edge takes.
"""

from __future__ import annotations

import json
import os
import random
import time
from pathlib import Path
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, Timer

_PERIOD_NS = 20
_SETTLE_NS = 1  # for the probes, several of which fit into half a period
_SILENCE = 2000  # clocks without a transfer, both sides willing most of the time, that mean a hang
_PROGRESS_EVERY = 4096  # clocks
_PROBED_SHARE = 1 / 32  # of all clocks, at which combinational paths between the handshakes are looked for


class ProtocolError(Exception):
    """The core broke a rule of AXI4-Stream."""


class _Bench:
    """One run: pins, clock, checks."""

    def __init__(self, dut: Any, folder: Path) -> None:
        self.dut = dut
        self.folder = folder
        self.config = json.loads((folder / "bench.json").read_text(encoding="utf-8"))
        self.words: list[int] = [int(word, 16) for word in (folder / "words.txt").read_text().split()]
        self.clocks = 0
        self.received: list[int] = []
        self._falling = FallingEdge(dut.aclk)

    async def clock(self) -> None:
        """Let one rising edge pass."""
        await self._falling
        self.clocks += 1

    async def reset(self) -> None:
        """Hold the reset for some clocks with the inputs idle."""
        dut = self.dut
        dut.aresetn.value = 0
        dut.s_axis_tvalid.value = 0
        dut.s_axis_tdata.value = 0
        dut.m_axis_tready.value = 0
        for _ in range(4):
            await self.clock()
        dut.aresetn.value = 1
        await Timer(_SETTLE_NS, "ns")
        if self.bit(dut.m_axis_tvalid, "m_axis_tvalid"):
            raise ProtocolError("m_axis_tvalid must be low after reset")

    def bit(self, handle: Any, name: str) -> bool:
        """Value of a handshake signal, which must be known."""
        value = handle.value
        if not value.is_resolvable:
            raise ProtocolError(f"{name} must be 0 or 1, not {value}, at clock {self.clocks}")
        return bool(value)

    def word(self) -> int:
        """Output word, every bit of which must be known."""
        value = self.dut.m_axis_tdata.value
        if not value.is_resolvable:
            raise ProtocolError(f"m_axis_tdata must be known, not {value}, at sample {len(self.received)}")
        return int(value.to_unsigned())

    async def output_appears_without_ready(self) -> None:
        """Check that a core offers a result that it holds whether or not the sink is ready."""
        dut = self.dut
        dut.s_axis_tvalid.value = 1
        dut.s_axis_tdata.value = self.words[0]
        for _ in range(self.config["latency_cycles"] + 64):
            await self.clock()
            if self.bit(dut.m_axis_tvalid, "m_axis_tvalid"):
                return
        raise ProtocolError("m_axis_tvalid must not wait for m_axis_tready")

    async def probe(self) -> None:
        """Neither handshake output may follow an input within a clock."""
        dut = self.dut
        before = str(dut.s_axis_tready.value), str(dut.m_axis_tvalid.value), str(dut.m_axis_tdata.value)
        held = int(dut.s_axis_tvalid.value), int(dut.m_axis_tready.value)
        for valid, ready in ((0, 0), (0, 1), (1, 0), (1, 1)):
            dut.s_axis_tvalid.value = valid
            dut.m_axis_tready.value = ready
            await Timer(_SETTLE_NS, "ns")
            after = str(dut.s_axis_tready.value), str(dut.m_axis_tvalid.value), str(dut.m_axis_tdata.value)
            if after != before:
                raise ProtocolError(
                    "outputs must not follow s_axis_tvalid or m_axis_tready within a clock, "
                    f"as they did at clock {self.clocks}"
                )
        dut.s_axis_tvalid.value, dut.m_axis_tready.value = held[0], held[1]
        await Timer(_SETTLE_NS, "ns")

    async def stream(self, words: list[int], *, probe: bool) -> None:
        """Send `words` at a random pace and receive as many, checking every clock."""
        dut = self.dut
        pace = random.Random(self.config["seed"])
        idle, stall = _Pace(pace, self.config["idle"]), _Pace(pace, self.config["stall"])
        target = len(self.received) + len(words)
        sent, offered, silence = 0, False, 0
        was_ready: bool | None = None
        was_offered: bool | None = None
        held: int | None = None  # the word that the core offers and we have not taken
        while len(self.received) < target:
            if not offered:
                offered = sent < len(words) and next(idle)
                if offered != was_offered:
                    dut.s_axis_tvalid.value = int(offered)
                    was_offered = offered
                if offered:
                    dut.s_axis_tdata.value = words[sent]
            ready = next(stall)
            if ready != was_ready:  # a write costs as much as the rest of a clock
                dut.m_axis_tready.value = int(ready)
                was_ready = ready
            if probe or pace.random() < _PROBED_SHARE:
                await Timer(_SETTLE_NS, "ns")
                await self.probe()
            valid = self.bit(dut.m_axis_tvalid, "m_axis_tvalid")
            accepted = offered and self.bit(dut.s_axis_tready, "s_axis_tready")
            word = self.word() if valid else None
            if held is not None and word != held:
                what = "drop m_axis_tvalid" if word is None else f"change m_axis_tdata from {held:#x} to {word:#x}"
                raise ProtocolError(f"a stalled core must not {what}, as it did at sample {len(self.received)}")
            held = word if valid and not ready else None
            if word is not None and ready:
                self.received.append(word)
            if accepted:
                sent, offered = sent + 1, False
            silence = 0 if accepted or (valid and ready) else silence + 1
            if silence > _SILENCE + self.config["latency_cycles"]:
                raise ProtocolError(
                    f"a sample must move at least every {silence - 1} clocks: "
                    f"{sent} went in and {len(self.received)} came out before it hung"
                )
            await self.clock()
            if self.clocks % _PROGRESS_EVERY == 0:
                self.report(len(self.received))
        dut.s_axis_tvalid.value = 0

    async def nothing_more_comes(self) -> None:
        """After the last result the core must be silent."""
        self.dut.m_axis_tready.value = 1
        for _ in range(self.config["latency_cycles"] + 64):
            await self.clock()
            if self.bit(self.dut.m_axis_tvalid, "m_axis_tvalid"):
                raise ProtocolError(f"{len(self.received)} samples must come out, not more")

    def report(self, done: int) -> None:
        """Leave the count of samples for the parent process to show."""
        (self.folder / "progress.txt").write_text(str(done), encoding="utf-8")


class _Pace:
    """Random go and wait with the given share of waiting, in bursts, at full speed, and one clock at a time."""

    def __init__(self, source: random.Random, waiting: float) -> None:
        self._source, self._waiting = source, waiting
        self._left, self._share = 0, 0.0

    def __next__(self) -> bool:
        if self._left == 0:
            # Phases of no waiting and of heavy waiting keep the wanted share on average.
            self._left = self._source.randrange(20, 200)
            spread = min(self._waiting, 1 - self._waiting, 0.4)
            self._share = self._waiting + self._source.choice((-spread, 0.0, spread))
        self._left -= 1
        return self._source.random() >= self._share


async def _run(bench: _Bench) -> None:
    bench.dut.aclk.value = 0
    Clock(bench.dut.aclk, _PERIOD_NS, "ns").start(start_high=False)
    await bench.reset()
    await bench.output_appears_without_ready()
    # Reset in mid-run: what went in before must leave no trace.
    await bench.reset()
    first = bench.words[: min(len(bench.words), 64)]
    await bench.stream(first, probe=True)
    again = list(bench.received)
    bench.received.clear()
    await bench.reset()
    bench.clocks = 0
    await bench.stream(bench.words, probe=False)
    clocks = bench.clocks
    await bench.nothing_more_comes()
    if bench.received[: len(first)] != again:
        raise ProtocolError("the first results after a reset must not depend on what came before it")
    bench.clocks = clocks


@cocotb.test()
async def core_under_test(dut: Any) -> None:
    """Run the whole stimulus; leave the outcome in ``result.json``, written last."""
    folder = Path(os.environ["SOSMITH_BENCH"])
    bench = _Bench(dut, folder)
    started = time.monotonic()
    failure = None
    try:
        await _run(bench)
    except ProtocolError as error:
        failure = str(error)
    (folder / "received.txt").write_text("\n".join(f"{word:x}" for word in bench.received), encoding="utf-8")
    bench.report(len(bench.received))
    outcome = {"clocks": bench.clocks, "failure": failure, "seconds": time.monotonic() - started}
    (folder / "result.json").write_text(json.dumps(outcome), encoding="utf-8")
    assert failure is None, failure
