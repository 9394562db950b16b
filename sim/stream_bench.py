"""The cocotb test that runs inside the simulator: drives a core's streams, checks the protocol, stores the results.

Configuration and stimulus are read from the folder named by SOSMITH_BENCH (``bench.json`` and ``words.txt``);
``result.json`` and ``received.txt`` are written there. The bench wakes once per clock, at the falling edge: it reads
the settled outputs of the previous rising edge, and sets the inputs for the next one. While a core that takes many
clocks per sample is busy and nothing can happen, the bench sleeps.
"""

from __future__ import annotations

import json
import os
import random
import time
from pathlib import Path
from typing import Any, NamedTuple

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, First, RisingEdge, Timer
from cocotb.utils import get_sim_time

_PERIOD_NS = 20
_SETTLE_NS = 1  # for the probes, several of which fit into half a period
_SILENCE = 2000  # clocks without a transfer, with both sides ready most of the time, after which the core has hung
_PROGRESS_EVERY = 4096  # clocks
_BUSY = 64  # clocks from input to output above which sleeping while a core is busy saves time
_PROBED_SHARE = 1 / 32  # of all clocks, at which combinational paths between the handshakes are tested for


class ProtocolError(Exception):
    """The core broke a rule of AXI4-Stream."""


class Word(NamedTuple):
    """A word of a stream: channel, data and, on the output stream, status."""

    tdest: int
    tdata: int
    tuser: int = 0

    def __str__(self) -> str:
        return " ".join(f"{value:x}" for value in self)


class _Bench:
    """One run: pins, clock, checks."""

    def __init__(self, dut: Any, folder: Path) -> None:
        self.dut = dut
        self.folder = folder
        self.config = json.loads((folder / "bench.json").read_text(encoding="utf-8"))
        lines = (folder / "words.txt").read_text().splitlines()
        self.words = [Word(*(int(value, 16) for value in line.split())) for line in lines]
        self.clocks = 0
        self.received: list[Word] = []
        self.patience = self.config["latency_cycles"] + self.config["reset_cycles"]
        self._outputs = [
            (name, getattr(dut, f"m_axis_{name}")) for name in ("tdest", "tdata", "tuser") if self.has(name)
        ]
        self._falling = FallingEdge(dut.aclk)
        self._shown = 0

    def has(self, name: str) -> bool:
        """Whether the streams have the optional signal `name`."""
        return name == "tdata" or bool(self.config[name])

    async def clock(self) -> None:
        """Wait for one rising edge."""
        await self._falling
        self.clocks += 1

    def start_counting(self) -> None:
        """Count clocks from here."""
        self.clocks = self._shown = 0

    async def busy(self) -> None:
        """Skip the clocks at which the core neither accepts nor offers anything."""
        dut, before = self.dut, get_sim_time("ns")
        limit = Timer(self.patience * _PERIOD_NS, "ns")
        await First(RisingEdge(dut.s_axis_tready), RisingEdge(dut.m_axis_tvalid), limit)
        await self._falling
        self.clocks += round((get_sim_time("ns") - before) / _PERIOD_NS)

    def offer(self, word: Word | None) -> None:
        """Offer `word` to the core, or nothing."""
        self.dut.s_axis_tvalid.value = int(word is not None)
        if word is not None:
            self.dut.s_axis_tdata.value = word.tdata
            if self.has("tdest"):
                self.dut.s_axis_tdest.value = word.tdest

    async def reset(self) -> None:
        """Hold the reset for some clocks with the inputs idle."""
        dut = self.dut
        dut.aresetn.value = 0
        self.offer(Word(0, 0))
        self.offer(None)
        dut.m_axis_tready.value = 0
        for _ in range(4):
            await self.clock()
        dut.aresetn.value = 1
        await Timer(_SETTLE_NS, "ns")
        if self.bit(dut.m_axis_tvalid, "m_axis_tvalid"):
            raise ProtocolError("m_axis_tvalid must be low after reset")

    def bit(self, handle: Any, name: str) -> bool:
        """Value of a handshake signal, which must not be X or Z."""
        value = handle.value
        if not value.is_resolvable:
            raise ProtocolError(f"{name} must be 0 or 1, not {value}, at clock {self.clocks}")
        return bool(value)

    def word(self) -> Word:
        """Output word, in which no bit may be X or Z."""
        found = {}
        for name, handle in self._outputs:
            value = handle.value
            if not value.is_resolvable:
                raise ProtocolError(f"m_axis_{name} must be known, not {value}, at sample {len(self.received)}")
            found[name] = int(value.to_unsigned())
        return Word(found.get("tdest", 0), found["tdata"], found.get("tuser", 0))

    async def output_appears_without_ready(self) -> None:
        """Check that a core with a result asserts ``tvalid`` whether or not the sink is ready."""
        self.offer(self.words[0])
        for _ in range(self.patience + 64):
            await self.clock()
            if self.bit(self.dut.m_axis_tvalid, "m_axis_tvalid"):
                return
        raise ProtocolError("m_axis_tvalid must not wait for m_axis_tready")

    async def probe(self) -> None:
        """Check that no handshake output depends combinationally on an input."""
        dut = self.dut
        watched = [dut.s_axis_tready, dut.m_axis_tvalid, *(handle for _, handle in self._outputs)]
        before = [str(handle.value) for handle in watched]
        held = int(dut.s_axis_tvalid.value), int(dut.m_axis_tready.value)
        for valid, ready in ((0, 0), (0, 1), (1, 0), (1, 1)):
            dut.s_axis_tvalid.value = valid
            dut.m_axis_tready.value = ready
            await Timer(_SETTLE_NS, "ns")
            if [str(handle.value) for handle in watched] != before:
                raise ProtocolError(
                    "outputs must not follow s_axis_tvalid or m_axis_tready within a clock, "
                    f"as they did at clock {self.clocks}"
                )
        dut.s_axis_tvalid.value, dut.m_axis_tready.value = held[0], held[1]
        await Timer(_SETTLE_NS, "ns")

    async def stream(self, words: list[Word], *, probe: bool) -> None:
        """Send `words` at a random pace and receive the same number, checking every clock."""
        dut = self.dut
        pace = random.Random(self.config["seed"])
        idle, stall = _Pace(pace, self.config["idle"]), _Pace(pace, self.config["stall"])
        target = len(self.received) + len(words)
        sent, offered, silence = 0, False, 0
        was_ready: bool | None = None
        was_offered: bool | None = None
        held: Word | None = None  # the word that the core offers and the bench has not accepted
        while len(self.received) < target:
            if not offered:
                offered = sent < len(words) and next(idle)
                if offered or offered != was_offered:
                    self.offer(words[sent] if offered else None)
                was_offered = offered
            ready = next(stall)
            if ready != was_ready:  # a write takes as long as the rest of a clock
                dut.m_axis_tready.value = int(ready)
                was_ready = ready
            if probe or pace.random() < _PROBED_SHARE:
                await Timer(_SETTLE_NS, "ns")
                await self.probe()
            valid = self.bit(dut.m_axis_tvalid, "m_axis_tvalid")
            accepted = offered and self.bit(dut.s_axis_tready, "s_axis_tready")
            word = self.word() if valid else None
            if held is not None and word != held:
                raise ProtocolError(
                    f"a stalled core must not {_change(held, word)}, as it did at sample {len(self.received)}"
                )
            held = word if valid and not ready else None
            if word is not None and ready:
                self.received.append(word)
            if accepted:
                sent, offered = sent + 1, False
            silence = 0 if accepted or (valid and ready) else silence + 1
            if silence > _SILENCE + self.patience:
                raise ProtocolError(
                    f"a sample must move at least every {silence - 1} clocks: "
                    f"{sent} went in and {len(self.received)} came out before it hung"
                )
            if offered and not accepted and not valid and self.patience > _BUSY:
                before = self.clocks
                await self.busy()
                silence += self.clocks - before - 1
            else:
                await self.clock()
            if self.clocks >= self._shown + _PROGRESS_EVERY:
                self._shown = self.clocks
                self.report(len(self.received))
        self.offer(None)

    async def nothing_more_comes(self) -> None:
        """Check that the core is silent after the last result."""
        self.dut.m_axis_tready.value = 1
        for _ in range(self.config["latency_cycles"] + 64):
            await self.clock()
            if self.bit(self.dut.m_axis_tvalid, "m_axis_tvalid"):
                raise ProtocolError(f"{len(self.received)} samples must come out, not more")

    def report(self, done: int) -> None:
        """Write the number of samples for the parent process to show."""
        (self.folder / "progress.txt").write_text(str(done), encoding="utf-8")


def _change(held: Word, word: Word | None) -> str:
    """Say what a stalled core did to the word that it offered."""
    if word is None:
        return "drop m_axis_tvalid"
    name = next(name for name in Word._fields if getattr(held, name) != getattr(word, name))
    return f"change m_axis_{name} from {getattr(held, name):#x} to {getattr(word, name):#x}"


class _Pace:
    """Random sequence of go and wait with the given share of waiting: in bursts, at full speed, and single clocks."""

    def __init__(self, source: random.Random, waiting: float) -> None:
        self._source, self._waiting = source, waiting
        self._left, self._share = 0, 0.0

    def __next__(self) -> bool:
        if self._left == 0:
            # Phases without waiting and with heavy waiting average to the given share.
            self._left = self._source.randrange(20, 200)
            spread = min(self._waiting, 1 - self._waiting, 0.4)
            self._share = self._waiting + self._source.choice((-spread, 0.0, spread))
        self._left -= 1
        return self._source.random() >= self._share


async def _run(bench: _Bench) -> None:
    bench.dut.aclk.value = 0
    Clock(bench.dut.aclk, _PERIOD_NS, "ns", impl="gpi").start(start_high=False)
    await bench.reset()
    await bench.output_appears_without_ready()
    # Reset in mid-run: earlier inputs must have no effect.
    await bench.reset()
    first = bench.words[: min(len(bench.words), 64)]
    await bench.stream(first, probe=True)
    again = list(bench.received)
    bench.received.clear()
    await bench.reset()
    bench.start_counting()
    await bench.stream(bench.words, probe=False)
    clocks = bench.clocks
    await bench.nothing_more_comes()
    if bench.received[: len(first)] != again:
        raise ProtocolError("the first results after a reset must not depend on what came before it")
    bench.clocks = clocks


@cocotb.test()
async def core_under_test(dut: Any) -> None:
    """Run the whole stimulus and write the outcome to ``result.json`` last."""
    folder = Path(os.environ["SOSMITH_BENCH"])
    bench = _Bench(dut, folder)
    started = time.monotonic()
    failure = None
    try:
        await _run(bench)
    except ProtocolError as error:
        failure = str(error)
    (folder / "received.txt").write_text("\n".join(map(str, bench.received)), encoding="utf-8")
    bench.report(len(bench.received))
    outcome = {"clocks": bench.clocks, "failure": failure, "seconds": time.monotonic() - started}
    (folder / "result.json").write_text(json.dumps(outcome), encoding="utf-8")
    assert failure is None, failure
