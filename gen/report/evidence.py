"""What a report shows: the facts about a design, a run of its core, and what ran it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from sosmith.gen.fpga.synthesis import Netlist
from sosmith.gen.output.core_facts import CoreFacts
from sosmith.gen.report.input_ranges import InputRange
from sosmith.gen.report.provenance import Provenance
from sosmith.gen.report.recursion import Recursion
from sosmith.gen.report.run import Run


@dataclass(frozen=True, kw_only=True)
class Alternative:
    """Another realization at the same word lengths, run on the same input codes.

    Attributes
    ----------
    name : str
        Its name in the specification, such as ``df1``.
    max_abs, rms : float
        Largest and root-mean-square error against the golden chain, in the output's unit.
    """

    name: str
    max_abs: float
    rms: float


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """Everything a report shows.

    Attributes
    ----------
    facts : CoreFacts
        The design.
    run : Run
        What went in and came out.
    simulator : str
        Name of the simulator.
    seed : int
        Seed of all random handshakes and noise.
    tools : Mapping of str to str
        Version by tool.
    wall_seconds, cycles_per_second : float
        Duration and speed of the simulation.
    gates : Netlist or None
        The netlist that ran, None if the SystemVerilog itself did.
    recursions : sequence of Recursion
        What each section computes, possibly none.
    alternatives : sequence of Alternative
        Other realizations at the same word lengths, possibly none.
    uncertainty : Mapping or None
        The uncertainty budget of a reading, in the types of JSON; None if nothing is known of what the calibration is
        worth.
    provenance : Provenance or None
        What identifies the run; None if unknown.
    specification : str
        Name of the specification's file, ``""`` if unknown.
    files : Mapping of str to str
        SHA-256 of each generated file by its name, the certificate among them.
    date : str or None
        Date of the run as the user gave it; None if none was given, so that two runs are the same.
    input_ranges : sequence of InputRange
        How the codes lie in the ranges of the inputs; empty if unknown.
    """

    facts: CoreFacts
    run: Run
    simulator: str
    seed: int
    tools: Mapping[str, str]
    wall_seconds: float
    cycles_per_second: float
    gates: Netlist | None = None
    recursions: Sequence[Recursion] = ()
    alternatives: Sequence[Alternative] = ()
    uncertainty: Mapping[str, Any] | None = None
    provenance: Provenance | None = None
    specification: str = ""
    files: Mapping[str, str] = field(default_factory=dict)
    date: str | None = None
    input_ranges: Sequence[InputRange] = ()

    def __post_init__(self) -> None:
        if not 0 < self.facts.max_error < math.inf:
            raise ValueError(f"max_error must be positive and finite, not {self.facts.max_error!r}")
        if not 0 <= self.facts.error_bound < math.inf:
            raise ValueError(f"error_bound must be at least 0 and finite, not {self.facts.error_bound!r}")

    @property
    def realization(self) -> str:
        """Structure of the sections, ``"none"`` without any."""
        return self.facts.realization or "none"

    @property
    def shown(self) -> Evidence:
        """The same with the samples of the one channel that pictures show: the one with the largest error."""
        return replace(self, run=self.run.of_channel(self.run.worst_channel))

    @property
    def rivals(self) -> list[Alternative]:
        """The alternatives that are not this design itself."""
        return [other for other in self.alternatives if other.name != self.realization]
