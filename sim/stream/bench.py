"""The bench: drives a core's streams, checks the protocol, stores the results, in any simulator.

Configuration and stimulus are read from a folder (``bench.json`` and ``sent.npy``); ``result.json`` and
``received.npy`` are written there. The bench wakes once per clock, at the falling edge: it reads the settled outputs of
the previous rising edge, and sets the inputs for the next one. While a core that takes many clocks per sample is busy
and nothing can happen, the bench sleeps. Where the model has the compiled loop, the long stream runs in there instead,
clock for clock as here.
"""

from __future__ import annotations

import copy
import json
import random
import time
from pathlib import Path

from sosmith.sim.beats import Beats
from sosmith.sim.stream import compiled_loop
from sosmith.sim.stream.bursts import Pace
from sosmith.sim.stream.pins import Pins
from sosmith.sim.stream.rules import BUSY, PROBED_SHARE, SILENCE, ProtocolError, Word, followed, hung, moved, too_many

_PROGRESS_EVERY = 4096  # clocks


class StreamBench:
    """One run: pins, clocks, checks."""

    def __init__(self, pins: Pins, folder: Path) -> None:
        self.pins = pins
        self.folder = folder
        self.config = json.loads((folder / "bench.json").read_text(encoding="utf-8"))
        self.words = Beats.load(folder / "sent.npy")
        self.clocks = 0
        self.count = 0
        self.patience = self.config["latency_cycles"] + self.config["reset_cycles"]
        bits = self.config["tdata_bits"], self.config["tuser_bits"]
        self._received = Beats.zeros(self.results(self.words), *bits)
        self._outputs = [(name, f"m_axis_{name}") for name in ("tdest", "tdata", "tuser") if self.has(name)]
        self._expected = 0
        self._shown = 0

    @property
    def received(self) -> Beats:
        """What has come out since the counting began."""
        return self._received.first(self.count)

    def results(self, beats: Beats) -> int:
        """Count what comes out: of each channel a result for the first sample and each group behind it, with copies."""
        config = self.config
        return beats.results(int(config["samples_per_result"]), int(config["copies_per_result"]), config["rates"])

    def has(self, name: str) -> bool:
        """Whether the streams have the optional signal `name`."""
        return name == "tdata" or bool(self.config[name])

    async def clock(self) -> None:
        """Wait for one rising edge."""
        await self.pins.clock()
        self.clocks += 1

    def start_counting(self) -> None:
        """Count clocks and samples from here."""
        self.clocks = self.count = self._shown = 0

    def offer(self, word: Word | None) -> None:
        """Offer `word` to the core, or nothing."""
        self.pins.write("s_axis_tvalid", int(word is not None))
        if word is not None:
            self.pins.write("s_axis_tdata", word.tdata)
            if self.has("tdest"):
                self.pins.write("s_axis_tdest", word.tdest)

    async def reset(self) -> None:
        """Hold the reset for some clocks with the inputs idle."""
        pins = self.pins
        pins.write("aresetn", 0)
        self.offer(Word(0, 0))
        self.offer(None)
        for name in ("m_axis_tready", *self.config["zeros"]):
            pins.write(name, 0)
        for _ in range(4):
            await self.clock()
        pins.write("aresetn", 1)
        await pins.settle()
        if self.bit("m_axis_tvalid"):
            raise ProtocolError("m_axis_tvalid must be low after reset")

    def bit(self, name: str) -> bool:
        """Value of a handshake signal, which must not be X or Z."""
        value = self.pins.read(name)
        if isinstance(value, str):
            raise ProtocolError(f"{name} must be 0 or 1, not {value}, at clock {self.clocks}")
        return bool(value)

    def word(self) -> Word:
        """Output word, in which no bit may be X or Z."""
        values = {}
        for name, port in self._outputs:
            value = self.pins.read(port)
            if isinstance(value, str):
                raise ProtocolError(f"{port} must be known, not {value}, at sample {self.count}")
            values[name] = value
        return Word(values.get("tdest", 0), values["tdata"], values.get("tuser", 0))

    async def output_appears_without_ready(self) -> None:
        """Check that a core with a result asserts ``tvalid`` whether or not the sink is ready."""
        self.offer(_words(self.words.first(1))[0])
        for _ in range(self.patience + 64):
            await self.clock()
            if self.bit("m_axis_tvalid"):
                return
        raise ProtocolError("m_axis_tvalid must not wait for m_axis_tready")

    async def probe(self, *, offered: bool, ready: bool) -> None:
        """Check that no handshake output depends combinationally on an input; leave these as they are given."""
        pins = self.pins
        watched = ["s_axis_tready", "m_axis_tvalid", *(port for _, port in self._outputs)]
        before = [pins.read(port) for port in watched]
        for valid, accepting in ((0, 0), (0, 1), (1, 0), (1, 1)):
            pins.write("s_axis_tvalid", valid)
            pins.write("m_axis_tready", accepting)
            await pins.settle()
            if [pins.read(port) for port in watched] != before:
                raise followed(self.clocks)
        pins.write("s_axis_tvalid", int(offered))
        pins.write("m_axis_tready", int(ready))
        await pins.settle()

    async def stream(self, beats: Beats, *, probe: bool) -> None:
        """Send `beats` at a random pace and receive all their results, checking every clock."""
        pins, words = self.pins, _words(beats)
        self._expected = self.results(beats)
        source = random.Random(self.config["seed"])
        idle, stall = Pace(source, self.config["idle"]), Pace(source, self.config["stall"])
        sent, offered, silence = 0, False, 0
        was_ready: bool | None = None
        was_offered: bool | None = None
        pending: Word | None = None  # the word that the core offers and the bench has not accepted
        while sent < len(words) or self.count < self._expected:
            if not offered:
                offered = sent < len(words) and next(idle)
                if offered or offered != was_offered:
                    self.offer(words[sent] if offered else None)
                was_offered = offered
            ready = next(stall)
            if ready != was_ready:  # a write takes as long as the rest of a clock
                pins.write("m_axis_tready", int(ready))
                was_ready = ready
            if probe or source.random() < PROBED_SHARE:
                await pins.settle()
                await self.probe(offered=offered, ready=ready)
            valid = self.bit("m_axis_tvalid")
            accepted = offered and self.bit("s_axis_tready")
            word = self.word() if valid else None
            if pending is not None and word != pending:
                raise moved(pending, word, self.count)
            pending = word if valid and not ready else None
            if word is not None and ready:
                self.keep(word)
            if accepted:
                sent, offered = sent + 1, False
            silence = 0 if accepted or (valid and ready) else silence + 1
            if silence > SILENCE + self.patience:
                raise hung(silence, sent, self.count)
            if offered and not accepted and not valid and self.patience > BUSY:
                slept = await pins.busy(self.patience)
                self.clocks += slept
                silence += slept - 1
            else:
                await self.clock()
            if self.clocks >= self._shown + _PROGRESS_EVERY:
                self._shown = self.clocks
                self.report(self.count)
        self.offer(None)

    def stream_compiled(self, beats: Beats) -> None:
        """Do as `stream` does, without probing every clock, in the compiled loop."""
        self.clocks, self.count, error = compiled_loop.stream(
            self.pins.library,
            beats,
            self._received,
            seed=self.config["seed"],
            idle=self.config["idle"],
            stall=self.config["stall"],
            patience=self.patience,
            progress=self.report,
        )
        if error is not None:
            raise error
        self.offer(None)

    def keep(self, word: Word) -> None:
        """Store a word that has come out; there must be no more than are expected."""
        if self.count == self._expected:
            raise too_many(self.count)
        self._received.put(self.count, *word)
        self.count += 1

    async def nothing_more_comes(self) -> None:
        """Check that the core is silent after the last result."""
        self.pins.write("m_axis_tready", 1)
        for _ in range(self.config["latency_cycles"] + 64):
            await self.clock()
            if self.bit("m_axis_tvalid"):
                raise too_many(self.count)

    def report(self, done: int) -> None:
        """Write the number of samples for the parent process to show."""
        (self.folder / "progress.txt").write_text(str(done), encoding="utf-8")


def _words(beats: Beats) -> list[Word]:
    return [Word(*each) for each in beats.numbers()]


async def run_bench(bench: StreamBench) -> float:
    """Run the whole stimulus through a core; return the seconds of processor time that the long stream took.

    Raises
    ------
    ProtocolError
        If the core breaks a rule of AXI4-Stream.
    """
    await bench.reset()
    await bench.output_appears_without_ready()
    # Reset in mid-run: earlier inputs must have no effect.
    await bench.reset()
    first = bench.words.first(64)
    await bench.stream(first, probe=True)
    again = copy.deepcopy(bench.received)
    await bench.reset()
    bench.start_counting()
    started = time.process_time()
    if bench.config["compiled"]:
        bench.stream_compiled(bench.words)
    else:
        await bench.stream(bench.words, probe=False)
    clocks, seconds = bench.clocks, time.process_time() - started
    await bench.nothing_more_comes()
    if not bench.received.first(len(again)).same_as(again):
        raise ProtocolError("the first results after a reset must not depend on what came before it")
    bench.clocks = clocks
    return seconds


async def run_in(folder: Path, pins: Pins) -> str | None:
    """Run the whole stimulus, write the outcome to ``result.json`` last, and return what failed."""
    bench = StreamBench(pins, folder)
    failure, seconds = None, 0.0
    try:
        seconds = await run_bench(bench)
    except ProtocolError as error:
        failure = str(error)
    bench.received.save(folder / "received.npy")
    bench.report(bench.count)
    outcome = {"clocks": bench.clocks, "failure": failure, "seconds": seconds}
    (folder / "result.json").write_text(json.dumps(outcome), encoding="utf-8")
    return failure
