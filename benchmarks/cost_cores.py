"""The designs whose cost is measured, and their targets; what is recorded of them in benchmarks/cost.json."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

from benchmarks.synthesis import TARGETS, title

from sosmith.gen.architectures import registry
from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.blocks import Blocks, blocks_for
from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.specification import combinations
from sosmith.gen.specification.specification import from_text, load
from sosmith.gen.word_lengths.objective import Objective
from sosmith.model.dataflow.protection import PROTECTIONS

ROOT = Path(__file__).resolve().parent.parent
RECORD = ROOT / "benchmarks" / "cost.json"
EXAMPLES = {"audio_lowpass": "filter", "flange_wear_bench": "instrument", "flange_wear_locomotive": "instrument"}
ARCHITECTURES = tuple(terms.name for terms in (combinations.PARALLEL, combinations.FOLDED, combinations.SERIAL))
SEEDS = (1, 2, 3, 4, 5)
GROWTH = 1.05
"""Largest allowed ratio of a figure to the recorded one."""

_ORDINARY = ("up5k", "hx8k", "hx1k", "ecp5")
"""Targets on which cores of every architecture are measured."""

_ALONE = "audio_lowpass"
"""Example that is measured on a GateMate too, for one channel, parallel and folded: placing takes minutes."""

_SMALLEST = "hx1k"
"""Target on which only the serial architecture is measured."""
Figures = dict[str, Any]


@dataclass(frozen=True)
class Core:
    """One of the designs.

    Attributes
    ----------
    example : str
        Name of its specification.
    architecture : str
        One that a specification can name.
    channels : int
        Number of channels.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`.
    bits : int
        Bits of input and output; 0 for those of the example.
    realization : str
        Structure of the filter sections; empty for the one that is chosen.
    lanes : int
        Samples a clock.
    clock : int
        Clock in MHz that it looks ahead for, or that a turn of its sections is spread for; 0 for the example's.
    multipliers : int
        Multiplier blocks that the specification names; 0 for "auto".
    order : int
        Order of the filter; 0 for that of the example.
    start : str
        What the filter starts from; empty for the example's.
    freedom : str
        "none" or "mask" for the filter of the recipe inside a mask in place of the example's, as that of the family or
        as any; empty for the example's.
    lsb : int
        Allowed error in LSB of the output; 0 for the example's.
    """

    example: str
    architecture: str
    channels: int = 1
    protect: str = "none"
    bits: int = 0
    realization: str = ""
    lanes: int = 1
    clock: int = 0
    multipliers: int = 0
    order: int = 0
    start: str = ""
    freedom: str = ""
    lsb: int = 0

    @property
    def key(self) -> str:
        """Key in the record."""
        guarded = "" if self.protect == "none" else f" {self.protect}"
        wide = f" {self.bits} bits" if self.bits else ""
        chosen = f" {self.realization}" if self.realization else ""
        several = f" {self.lanes} a clock" if self.lanes > 1 else ""
        ahead = f"{self._for_clock} {self.clock} MHz" if self.clock else ""
        blocks = f" multipliers {self.multipliers}" if self.multipliers else ""
        special = f"{guarded}{wide}{self._varied}{chosen}{several}{ahead}{blocks}{self._free}"
        return f"{self.example} {self.architecture} {self.channels}{special}"

    @property
    def label(self) -> str:
        """Name in tables and messages."""
        several = f", {self.channels} channels" if self.channels > 1 else ""
        guarded = "" if self.protect == "none" else f", protect = {self.protect}"
        wide = f", {self.bits} bits" if self.bits else ""
        chosen = f", {self.realization}" if self.realization else ""
        lanes = f", {self.lanes} samples a clock" if self.lanes > 1 else ""
        ahead = f",{self._for_clock} for {self.clock} MHz" if self.clock else ""
        blocks = f", multipliers = {self.multipliers}" if self.multipliers else ""
        special = f"{guarded}{wide}{self._varied}{chosen}{lanes}{ahead}{blocks}{self._free}"
        return f"{self.example} {self.architecture}{several}{special}"

    @property
    def _for_clock(self) -> str:
        return "" if self.architecture == combinations.MULTIPLEXED.name else " look-ahead"

    @property
    def _varied(self) -> str:
        order = f", order {self.order}" if self.order else ""
        order += f", {self.lsb} LSB" if self.lsb else ""
        return f"{order}, start = {self.start}" if self.start else order

    @property
    def _free(self) -> str:
        return {"": "", "none": ", by a mask", "mask": ", any inside a mask"}[self.freedom]

    @property
    def targets(self) -> list[str]:
        """Targets on which it is measured."""
        if self in SEVERAL:
            return list(SEVERAL[self])
        if self.lanes > 2:
            return ["ecp5_85"]
        if self.multipliers and not self.order:
            return [key for key in ("up5k", "ecp5") if TARGETS[key].device.multipliers >= self.multipliers]
        if self.realization or self.lanes > 1 or self.clock or self.order or self.start:
            return ["ecp5"]
        if self.bits or self.freedom or self.architecture == combinations.ONLINE.name:
            return ["hx8k", "ecp5"]
        if (self.architecture, EXAMPLES[self.example]) == (combinations.PARALLEL.name, "instrument"):
            return ["ecp5"]  # no iCE40 has enough multipliers for the polynomial
        wanted = [key for key in _ORDINARY if key != _SMALLEST or self.architecture == combinations.SERIAL.name]
        if self.protect == "none":
            alone = (self.example, self.channels) == (_ALONE, 1) and self.architecture != combinations.SERIAL.name
            return [*wanted, "gatemate"] if alone else wanted
        return [
            key
            for key in wanted
            if key == "ecp5" or (key == "up5k" and self.architecture != combinations.PARALLEL.name)
        ]


SEVERAL = {
    **{Core("audio_lowpass", "parallel", channels): ("ecp5",) for channels in (8, 12, 64)},
    Core("audio_lowpass", "folded", 64): ("up5k", "ecp5"),
    Core("flange_wear_locomotive", "parallel", 12): ("ecp5",),
    **{Core("flange_wear_locomotive", "folded", channels): ("up5k", "ecp5") for channels in (12, 64)},
    Core("flange_wear_locomotive", "serial", 12): ("hx1k",),
    Core("flange_wear_locomotive", "serial", 64): ("hx8k",),
}
"""Cores for several channels, and their targets: few, as what channels cost is the same for all filters."""

PROTECTED = tuple(
    Core(example, architecture, channels, protect)
    for example, architecture, channels in (
        ("audio_lowpass", "folded", 1),
        ("flange_wear_locomotive", "serial", 1),
        ("audio_lowpass", "parallel", 1),
        ("audio_lowpass", "parallel", 12),
    )
    for protect in PROTECTIONS[1:]
    if (channels, protect) != (1, "correct")
    or architecture != combinations.PARALLEL.name  # registers have parity in both
)
"""Cores whose memories and states are protected."""
ONLINE = (
    Core("audio_lowpass", "online"),
    *(Core("audio_lowpass", architecture, bits=24) for architecture in (*ARCHITECTURES, combinations.ONLINE.name)),
)
"""Sections in on-line arithmetic, and what they are compared with for longer words."""
REALIZED = tuple(
    Core("audio_lowpass", "parallel", realization=name) for name in ("df1", "df2t", "df1_ef2", "state_space")
)
"""The state space beside direct sections, as Hourani compared them."""
FAST = (
    *(Core("audio_lowpass", "parallel", lanes=lanes) for lanes in (2, 4)),
    *(Core("audio_lowpass", "parallel", clock=clock) for clock in (100, 120)),
    *(Core("audio_lowpass", "parallel", lanes=lanes, clock=100) for lanes in (2, 4)),
)
"""More than a plain loop gives: several samples a clock, and look-ahead."""

TWO_PRODUCTS = tuple(Core(example, "folded", multipliers=2) for example in EXAMPLES)
"""Folded cores with two products a clock."""

FROM_ZERO = Core("audio_lowpass", "parallel", start="zero")
"""Without the logic of a steady start."""

TURNS = tuple(Core("audio_lowpass", "multiplexed", clock=clock) for clock in (30, 60))
"""Sections that share hardware, with few clocks a turn and with more."""

ORDER_SIX = (
    Core("audio_lowpass", "parallel", bits=18, order=6),
    *(Core("audio_lowpass", "multiplexed", bits=18, order=6, clock=clock) for clock in (30, 75)),
    *(Core("audio_lowpass", "multiplexed", bits=18, order=6, clock=clock, lsb=4) for clock in (30, 100)),
    Core("audio_lowpass", "folded", bits=18, order=6, multipliers=2),
    Core("audio_lowpass", "folded", bits=18, order=6),
)
"""Three sections of second order, for which others publish a core with a multiplier each."""

MASKED = tuple(Core("audio_lowpass", "parallel", freedom=freedom) for freedom in ("none", "mask"))
"""The family's filter for a mask, and any inside it."""

OF_THEIR_OWN = frozenset({*PROTECTED, *ONLINE, *REALIZED, *FAST, *TWO_PRODUCTS, *MASKED, *TURNS, *ORDER_SIX, FROM_ZERO})
"""Cores that have tables of their own."""

CORES = (
    *(
        core
        for example in EXAMPLES
        for architecture in ARCHITECTURES
        for core in (
            Core(example, architecture),
            *(other for other in SEVERAL if (other.example, other.architecture) == (example, architecture)),
        )
    ),
    *PROTECTED,
    *ONLINE,
    *REALIZED,
    *FAST,
    *TWO_PRODUCTS,
    *MASKED,
    *TURNS,
    *ORDER_SIX,
    FROM_ZERO,
)
Job = tuple[Core, str]
"""A core and its target."""


def objective_on(core: Core, key: str) -> Objective:
    """Return what a core is designed for on a target: digits as wide as its multipliers take, adders without any."""
    target = TARGETS[key]
    kind = registry.ARCHITECTURES[core.architecture]
    return kind.objective(target, adders=not target.device.multipliers, blocks=_blocks(core, key))


def _blocks(core: Core, key: str) -> Blocks:
    return blocks_for(core.multipliers or None, TARGETS[key])


@cache
def design(core: Core, objective: Objective, target: str = "") -> CoreDesign:
    """Design a core for one channel and without protection; the datapath is the same for more and with it.

    Without a target, it is that of the first one with the same objective.
    """
    example, architecture, bits = core.example, core.architecture, core.bits
    path = ROOT / "examples" / f"{example}.toml"
    spec = load(path)
    varied = spec.text.replace("bits = 16", f"bits = {bits}") if bits else spec.text
    if core.lsb:
        reach = spec.output.highest - spec.output.lowest + 1
        allowed = float(core.lsb * spec.output.lsb * reach / 2**bits if bits else core.lsb * spec.output.lsb)
        varied = varied.replace('max_error = "faithful"', f"max_error = {allowed!r}")
    varied = varied.replace("order = 5", f"order = {core.order}") if core.order else varied
    varied = varied.replace("[hardware]", f'[hardware]\nstart = "{core.start}"') if core.start else varied
    spec = from_text(varied, path)
    if core.freedom:
        mask = load(ROOT / "examples" / "recipes" / "inside_a_mask.toml").filter
        spec = replace(spec, filter=replace(mask, freedom=core.freedom))
    hardware = replace(spec.hardware, architecture=architecture, samples_per_clock=core.lanes, pipeline="plain")
    if core.multipliers:
        hardware = replace(hardware, multipliers=core.multipliers)
    if core.clock:
        pipeline = "plain" if architecture == combinations.MULTIPLEXED.name else "look-ahead"
        hardware = replace(hardware, pipeline=pipeline, clock=Fraction(core.clock * 10**6))
    wanted = replace(spec, hardware=hardware)
    first = target or next(key for key in TARGETS if objective_on(core, key) == objective)
    return design_core(wanted, core=EXAMPLES[example], realization=core.realization or None, board=TARGETS[first])


def design_on(core: Core, key: str) -> CoreDesign:
    """Return the design of a core, for one channel, as it is made for a target."""
    objective = objective_on(core, key)
    # How far loops look ahead, and for which multiplier blocks, is up to the FPGA.
    return design(replace(core, channels=1, protect="none"), objective, key if core.clock else "")


def architecture_on(core: Core, key: str) -> Architecture:
    """Return the architecture of a core as it is designed for a target."""
    made = design_on(core, key).architecture
    return replace(made, channels=core.channels, protect=core.protect, blocks=_blocks(core, key))


def realization_on(core: Core, key: str) -> str:
    """Return the realization of a core on a target."""
    return design_on(core, key).quantized.realization


def targets_in(record: Figures, core: Core) -> dict[str, Figures]:
    """Return the figures recorded for a core, by target."""
    found: dict[str, Figures] = record["cores"].get(core.key, {"targets": {}})["targets"]
    return found


def missing(record: Figures) -> list[str]:
    """List the cores without recorded figures, and their targets."""
    return _listed(lambda core, key: key not in targets_in(record, core))


def outdated(record: Figures) -> list[str]:
    """List the cores whose recorded figures are those of an earlier version, and their targets."""
    return _listed(lambda core, key: targets_in(record, core).get(key, {}).get("earlier", False))


def with_fewer_seeds(record: Figures) -> list[str]:
    """List the cores, and their targets, that were not placed with each seed."""

    def asked(core: Core, key: str) -> bool:
        return 0 < len(targets_in(record, core).get(key, {}).get("fmax", ())) < len(record["seeds"])

    return _listed(asked)


def _listed(asked: Callable[[Core, str], bool]) -> list[str]:
    left = {core: [title(TARGETS[key]) for key in core.targets if asked(core, key)] for core in CORES}
    return [f"{core.label} on {'; '.join(titles)}" for core, titles in left.items() if titles]


def fmax(figures: Figures) -> float:
    """Return the median over the seeds in MHz; 0 if the core cannot be placed."""
    return statistics.median(figures["fmax"]) if figures["fmax"] else 0.0


def recorded(record: Figures, keys: Iterable[str]) -> Iterable[tuple[Core, str, Figures]]:
    """Return all figures of some targets, each with its core and target; not those that have tables of their own."""
    return [
        (core, key, targets_in(record, core)[key])
        for core in CORES
        for key in keys
        if core not in OF_THEIR_OWN and key in targets_in(record, core)
    ]


def rate(core: Core, figures: Figures) -> float:
    """Return the samples per second at the median of fmax."""
    return 1e6 * fmax(figures) * core.lanes / figures["cycles"]


def logic_of(key: str, figures: Figures) -> int:
    """Return the logic cells of an iCE40, or all LUT4 of an ECP5."""
    found: int = figures["area"]["all_luts"] if key.startswith("ecp5") else figures["cells"]
    return found
