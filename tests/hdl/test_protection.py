"""Upsets in protected cores: none in a memory or a state is silent, and after a restart all is as after a reset."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from benchmarks import upset_simulation as upsets
from benchmarks.upset_simulation import Fate, Hit, Target
from tests.formal.small import leaky, resonator
from tests.gen.architectures.one_filter import design_in

import sosmith
from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.folded_fir import FoldedFir
from sosmith.gen.architectures.registry import ARCHITECTURES
from sosmith.gen.core import design_core
from sosmith.gen.output.core_facts import StreamFacts
from sosmith.hdl.plan.streams import dest_width, fields
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.model.arrays import Codes
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.decimator import Decimator
from sosmith.sim.beats import Beats
from sosmith.sim.simulation import simulate
from sosmith.sim.stream_packing import Order, pack, random_order, unpack

FAULT = 1 << 6
DECIMATOR_FORGETS = 7
"""Results of a channel, those on their way among them, until none has anything of a wrong bit in a decimator."""


class Case(NamedTuple):
    """A core."""

    datapath: str
    architecture: str
    channels: int
    protect: str
    reload: bool = False

    @property
    def core(self) -> Architecture:
        """The core itself."""
        named = replace(DATAPATHS[self.datapath](), name="core")  # "small" is a word of Verilog
        kind = FoldedFir if self.datapath == "rings" else ARCHITECTURES[self.architecture]
        return kind(named, self.channels, self.reload, self.protect)


def steady() -> Datapath:
    return design_in("folded", start="steady").datapath


def audio() -> Datapath:
    return design_in("folded").datapath


def decimated() -> Datapath:
    made = leaky()
    return replace(made, decimator=Decimator(input=made.inputs[0], factor=4, stages=3, dropped=6))


def rings() -> Datapath:
    tree = {
        "name": "core",
        "sample_rate": 1000.0,
        "input": {"x": {"bits": 6, "range": [-1.0, 1.0], "signed": True}},
        "filter": {"taps": [0.3, 0.17, 0.05, -0.17, 0.3], "decimate": 3},
        "output": {"bits": 8, "range": [-1.0, 1.0], "signed": True},
        "hardware": {"start": "zero"},
    }
    return sosmith.design(sosmith.Specification.load(tree)).core.datapath


DATAPATHS = {
    "leaky": leaky,
    "resonator": resonator,
    "audio": audio,
    "steady": steady,
    "decimated": decimated,
    "rings": rings,
}

FAST = (
    Case("leaky", "folded", 3, "correct"),
    Case("resonator", "parallel", 1, "detect"),
    Case("decimated", "parallel", 1, "detect"),
)
CASES = [
    pytest.param(case, id="-".join(map(str, case)), marks=[] if case in FAST else [pytest.mark.slow])
    for case in (
        *FAST,
        *(
            Case("audio", architecture, channels, protect, reload)
            for architecture in ("folded", "serial", "parallel")
            for channels in (1, 3, 20)
            for protect in ("detect", "correct")
            for reload in (False, True)
            if (channels == 20) <= (architecture == "parallel" and not reload)
        ),
        Case("steady", "parallel", 1, "detect"),
        Case("steady", "parallel", 3, "correct", True),
        Case("steady", "folded", 3, "correct"),
        Case("steady", "serial", 1, "detect"),
        *(
            Case("decimated", *core)
            for core in (
                ("parallel", 3, "detect"),
                ("parallel", 2, "correct"),
                ("folded", 1, "correct"),
                ("folded", 3, "detect"),
                ("serial", 3, "correct"),
            )
        ),
        *(
            Case("rings", "folded", channels, protect, reload)
            for channels, protect, reload in (
                (1, "detect", False),
                (3, "correct", False),
                (1, "correct", True),
                (2, "detect", True),
            )
        ),
    )
]


class Built(NamedTuple):
    """A built core, with what it was given."""

    case: Case
    core: Architecture
    target: Target
    codes: Codes
    order: Order

    @property
    def turns(self) -> Order:
        """The channel of each result: that of the samples which bring any."""
        factor, counts = self.core.datapath.samples_per_result, Counter[int]()
        turns = []
        for channel in self.order.tolist():
            if counts[channel] % factor == 0:
                turns.append(channel)
            counts[channel] += 1
        return np.array(turns)


@pytest.fixture(scope="module", params=CASES)
def built(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Built:
    case: Case = request.param
    core = case.core
    ports = core.datapath.inputs
    samples = 60 if case.datapath not in {"audio", "steady"} else 240 if case.architecture == "parallel" else 24
    samples = max(3, samples // case.channels) * core.datapath.samples_per_result
    rng = np.random.default_rng(1)
    codes = np.stack([rng.integers(p.lowest, p.highest + 1, (samples, case.channels)) for p in ports], axis=2)
    order = random_order(samples, case.channels, 1)
    facts = StreamFacts(fields=fields(ports), dest_width=dest_width(case.channels))
    target = upsets.build(core, pack(codes, order, facts), tmp_path_factory.mktemp("upsets"))
    return Built(case, core, target, codes, order)


def beats_of(built: Built, hits: list[Hit]) -> list[Beats]:
    """Return what comes out with each of the hits."""
    found = []
    for line in built.target.lines(hits, full=True):
        rows = [[int(part, 16) for part in beat.split(":")] for beat in line.split()[5:]]
        dest, data, user = (list(column) for column in zip(*rows, strict=True))
        found.append(Beats(np.array(dest), np.array(data, dtype=np.uint64), np.array(user, dtype=np.uint8)))
    return found


def from_reset(built: Built, first: int) -> list[int]:
    """Return the codes that come out if the core begins anew with result number `first`; a decimator does not."""
    datapath, turns = built.core.datapath, built.turns
    results = []
    for channel in range(built.case.channels):
        skipped, codes = int((turns[:first] == channel).sum()), built.codes[:, channel, :]
        if datapath.downsampler is not None:
            results.append(iter(datapath.compute(codes)[skipped:].tolist()))
            continue
        if datapath.decimator is not None:
            codes = datapath.decimator.compute(codes[:, 0])[:, np.newaxis]
        left = codes[skipped:]
        results.append(iter(datapath.behind_decimator.compute(left).tolist() if len(left) else []))
    return [next(results[channel]) for channel in turns[first:]]


def codes_of(built: Built, beats: Beats) -> list[int]:
    output = built.core.datapath.output
    facts = StreamFacts(fields=fields((output,)), dest_width=dest_width(built.case.channels))
    codes, _ = unpack(beats, built.turns, facts)
    turns = np.zeros(built.case.channels, dtype=int)
    found = []
    for channel in built.turns:
        found.append(int(codes[turns[channel], channel, 0]))
        turns[channel] += 1
    return found


@pytest.mark.slow
def test_without_an_upset_it_is_the_model(built: Built) -> None:
    (beats,) = beats_of(built, [Hit(built.target.places[0], 0, 0, -1, -1)])
    assert codes_of(built, beats) == from_reset(built, 0)
    assert not (beats.tuser & FAULT).any()


@pytest.mark.sweep(1)
def test_no_upset_in_a_memory_is_silent(built: Built) -> None:
    memories = built.target.memories
    case = built.case
    assert bool(memories) == (case.architecture != "parallel" or case.channels > 1 or case.reload)
    if memories:
        counts = upsets.counted(built.target.run(memories, 600, 1))
        noticed, other = ("corrected", "detected") if case.protect == "correct" else ("detected", "corrected")
        assert counts["silent"] == counts["lost"] == counts[other] == 0
        assert bool(counts[noticed]) == any(place.width > 3 for place in memories)  # bits that are there three times


def test_two_wrong_bits_of_a_word_are_not_silent_where_one_is_corrected(built: Built) -> None:
    memories = [place for place in built.target.memories if place.width > 3]
    if built.case.protect == "correct" and memories:
        counts = upsets.counted(built.target.run(memories, 600, 4, double=True))
        assert counts["silent"] == counts["lost"] == 0
        assert counts["detected"] > 60


def test_the_scrubber_mends_the_first_of_two_bits_before_the_second(built: Built) -> None:
    """A small core scrubs all its words within 16 samples, even those that no sample reads."""
    if built.case == FAST[0]:
        (words,) = (place for place in built.target.memories if place.name.endswith("words0"))
        starts = range(100, built.target.clocks - 700, 29)

        def fates(later: int) -> set[Fate]:
            hits = [Hit(words, word, 3, 5, clock, later) for word in range(words.depth) for clock in starts]
            return {upset.fate for upset in built.target.hit(hits)}

        assert fates(600) <= {Fate.CORRECTED, Fate.MASKED}
        assert Fate.DETECTED in fates(1)


def test_no_upset_in_a_state_of_one_channel_is_silent(built: Built) -> None:
    states = [place for place in built.target.states if not place.name.endswith(".kept_word")]
    case, decimates = built.case, built.core.decimator is not None
    one = case.channels == 1 and (decimates or case.architecture == "parallel")
    assert bool(states) == (one or (case.architecture == "parallel" and case.reload))
    if states:
        counts = upsets.counted(built.target.run(states, 600, 2))
        assert counts["silent"] == counts["lost"] == counts["corrected"] == 0
        assert counts["detected"] > 60


def test_what_counts_samples_is_mended_in_any_case(built: Built) -> None:
    kept = [place for place in built.target.states if place.name.endswith(".kept_word")]
    assert bool(kept) == (built.core.datapath.samples_per_result > 1 and built.case.channels == 1)
    if kept:
        counts = upsets.counted(built.target.run(kept, 200, 5))
        assert counts["masked"] + counts["corrected"] == 200


def test_after_a_fault_the_core_restarts(built: Built) -> None:
    """Those flagged first may still have met the old states; from one of them on all is as after a reset."""
    places = (*built.target.memories, *built.target.states)
    lasting = "bank|instructions|reload_port|coefficients|steps|control|kept"
    kept = [place for place in places if not re.search(lasting, place.name)]
    found = built.target.run(kept, 60, 3, double=built.case.protect == "correct")
    hits = [upset for upset in found if upset.fate is Fate.DETECTED]
    assert hits
    for upset, beats in zip(hits, beats_of(built, [upset.hit for upset in hits]), strict=True):
        assert upset.flagged is not None
        assert (beats.tuser[upset.flagged :] & FAULT).all()
        codes = codes_of(built, beats)
        late = (
            built.core.latency_cycles + 2 if built.core.decimator is None else DECIMATOR_FORGETS * built.case.channels
        )
        starts = range(upset.flagged, min(upset.flagged + late, len(codes) + 1))
        assert any(codes[start:] == from_reset(built, start) for start in starts)


@pytest.mark.slow
def test_without_protection_upsets_are_silent(tmp_path: Path) -> None:
    """Else the others would find nothing, whatever the core does."""
    core = Case("leaky", "folded", 1, "none").core
    port = core.datapath.inputs[0]
    codes = np.random.default_rng(1).integers(port.lowest, port.highest + 1, (40, 1, 1))
    sent = pack(codes, random_order(40, 1, 1), StreamFacts(fields=fields(core.datapath.inputs)))
    target = upsets.build(core, sent, tmp_path)
    counts = upsets.counted(target.run(target.memories, 200, 1))
    assert counts["silent"] > 50
    assert counts["detected"] == counts["corrected"] == 0
    assert counts["silent"] + counts["masked"] + counts["lost"] == 200


@pytest.mark.slow
@pytest.mark.parametrize("channels", [1, 12])
@pytest.mark.parametrize("protect", ["detect", "correct"])
@pytest.mark.parametrize("architecture", ["parallel", "folded", "serial"])
def test_a_protected_core_keeps_the_rules_of_its_streams(
    architecture: str, protect: str, channels: int, tmp_path: Path
) -> None:
    base = design_in(architecture).spec
    made = design_core(replace(base, channels=channels, hardware=replace(base.hardware, protect=protect)))
    traces = [replace(t, codes=t.codes[:60], truth=None, reading=None) for t in traces_for(made, "noise", seed=1)]
    for gates in (None, "ulx3s_25f") if (architecture, channels) == ("folded", 1) else (None,):
        evidence = simulate(made, traces, tmp_path / str(gates), seed=1, gates=gates)
        assert (evidence.run.mismatches, evidence.run.samples) == (0, 60 * channels)
