"""What one co-simulation run hands to the report: the samples, and the facts about the design behind them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from sosmith.gen.filter.response import FilterFacts
from sosmith.gen.fpga.synthesis import Netlist
from sosmith.gen.output.core_facts import LimitCycleFacts, NodeFormat, SectionFacts, SettlingFacts
from sosmith.gen.output.decimation_facts import DecimationFacts
from sosmith.gen.report.input_ranges import InputRange
from sosmith.gen.report.provenance import Provenance
from sosmith.gen.report.recursion import Recursion

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


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

    The sample arrays have the shape (n,) or (n, channels), one entry per output sample, in the output's `unit`; `time`
    is always of the shape (n,).

    Attributes
    ----------
    name, core, description : str
        The design: its identifier, which core of it ran, one sentence for people (may be empty).
    scenario : str
        Name of the trace or scenario that drove the input.
    unit : str
        Unit of the output, ``""`` for a plain number.
    lsb : float
        One step of the output code, positive.
    low, high : float
        Range of the output.
    bound : float
        Limit of ``|hardware - golden|`` over all inputs in range; 0 for hardware that rounds nothing.
    bound_parts : Mapping
        Contributions to `bound` by name; their sum need not equal it.
    proven : bool
        Whether `bound` is proven; if false, it is an estimate in double precision and the page says so.
    max_error : float
        The largest error the specification allows.
    time : ndarray
        Sampling instants in s, rising.
    truth : ndarray or None
        What an ideal sensor would have shown, where the trace knows it.
    reading : ndarray of bool or None
        The instants at which the measurement counts, all if None.
    unfiltered : ndarray or None
        The calibration alone, without a filter.
    golden : ndarray
        Double-precision chain on the same input codes, clamped to the output's range.
    hardware : ndarray
        The simulated hardware.
    mismatches : int
        Samples at which hardware and integer model differ; `first_mismatch` is the first of them.
    samples, channels, cycles, latency_cycles : int
        Compared samples over all channels, channels, clock cycles of the run, cycles from input to output.
    taken : int or None
        Samples that went in, over all channels; None for as many as were compared. More behind a decimator.
    simulator : str
        Name of the simulator.
    gates : Netlist or None
        The netlist that ran, None if the SystemVerilog itself did.
    seed : int
        Seed of all random handshakes and noise.
    tools : Mapping of str to str
        Version by tool.
    wall_seconds, cycles_per_second : float
        Duration and speed of the simulation.
    realization, architecture, why : str
        Structure of the sections, of the hardware, and the reason for the choice (may be empty).
    formats : sequence of NodeFormat
        Number formats along the datapath.
    sections : sequence of SectionFacts
        The filter's sections.
    recursions : sequence of Recursion
        What each section computes, possibly none.
    limit_cycles : sequence of LimitCycleFacts
        One for each section, in `unit`.
    settling : SettlingFacts or None
        Samples that show the start of the filter from zero; None if it starts otherwise.
    unsettled : ndarray of bool or None
        The samples that the hardware flagged as such; None if it has no flag for that.
    uncertainty : Mapping or None
        The uncertainty budget of a reading, in the types of JSON; None if nothing is known of what the calibration is
        worth.
    shown_channel : int or None
        Channel that the sample arrays are of, where they are of one of several.
    filter : FilterFacts or None
        None for a core without a filter.
    decimation : DecimationFacts or None
        The decimator before the filter; None without one.
    alternatives : sequence of Alternative
        Other realizations at the same word lengths, possibly none.
    provenance : Provenance or None
        What the run is told by; None if unknown.
    specification : str
        Name of the specification's file, ``""`` if unknown.
    files : Mapping of str to str
        SHA-256 of each generated file by its name, the certificate among them.
    date : str or None
        Date of the run as the user gave it; None if none was given, so that two runs are the same.
    zero : float or None
        Value of the output's code 0; None if it is `low`.
    input_ranges : sequence of InputRange
        How the codes lie in the ranges of the inputs; empty if unknown.
    """

    name: str
    core: str
    scenario: str
    unit: str
    lsb: float
    low: float
    high: float
    bound: float
    max_error: float
    time: Array
    golden: Array
    hardware: Array
    mismatches: int
    samples: int
    cycles: int
    latency_cycles: int
    simulator: str
    seed: int
    tools: Mapping[str, str]
    wall_seconds: float
    cycles_per_second: float
    realization: str
    architecture: str
    description: str = ""
    why: str = ""
    channels: int = 1
    first_mismatch: int | None = None
    proven: bool = False
    bound_parts: Mapping[str, float] = field(default_factory=dict)
    truth: Array | None = None
    reading: Mask | None = None
    unfiltered: Array | None = None
    formats: Sequence[NodeFormat] = ()
    sections: Sequence[SectionFacts] = ()
    recursions: Sequence[Recursion] = ()
    limit_cycles: Sequence[LimitCycleFacts] = ()
    settling: SettlingFacts | None = None
    unsettled: Mask | None = None
    uncertainty: Mapping[str, Any] | None = None
    shown_channel: int | None = None
    filter: FilterFacts | None = None
    decimation: DecimationFacts | None = None
    taken: int | None = None
    gates: Netlist | None = None
    alternatives: Sequence[Alternative] = ()
    provenance: Provenance | None = None
    specification: str = ""
    files: Mapping[str, str] = field(default_factory=dict)
    date: str | None = None
    zero: float | None = None
    input_ranges: Sequence[InputRange] = ()

    def __post_init__(self) -> None:
        for name in ("lsb", "max_error"):
            value = getattr(self, name)
            if not 0 < value < math.inf:
                raise ValueError(f"{name} must be positive and finite, not {value!r}")
        if not 0 <= self.bound < math.inf:
            raise ValueError(f"bound must be at least 0 and finite, not {self.bound!r}")
        if self.samples < 1:
            raise ValueError(f"samples must be at least 1, not {self.samples!r}")
        shape = np.shape(self.hardware)
        if len(shape) not in {1, 2} or min(shape) < 1:
            raise ValueError(f"hardware must have the shape (n,) or (n, channels) with n >= 1, not {shape!r}")
        if np.shape(self.time) != shape[:1]:
            raise ValueError(f"time must have the shape {shape[:1]!r}, not {np.shape(self.time)!r}")
        for name in ("golden", "truth", "reading", "unfiltered", "unsettled"):
            values = getattr(self, name)
            if values is not None and np.shape(values) != shape:
                raise ValueError(f"{name} must have the shape {shape!r}, not {np.shape(values)!r}")
        for name in ("golden", "hardware"):
            if not np.all(np.isfinite(getattr(self, name))):
                raise ValueError(f"{name} must be finite, not NaN or infinite")

    @property
    def error(self) -> Array:
        """Hardware minus golden, in `unit`."""
        return self.hardware - self.golden

    @property
    def worst_channel(self) -> int:
        """Number of the channel that has the largest error."""
        return int(np.argmax(np.abs(self.error).max(axis=0))) if self.error.ndim == 2 else 0

    def of_channel(self, channel: int) -> Evidence:
        """Return the same with arrays of the shape (n,), those of one channel."""
        if self.error.ndim == 1:
            return self
        names = ("golden", "hardware", "truth", "reading", "unfiltered", "unsettled")
        arrays = {name: getattr(self, name) for name in names}
        columns: dict[str, Any] = {name: None if array is None else array[:, channel] for name, array in arrays.items()}
        return replace(self, shown_channel=channel if self.channels > 1 else None, **columns)

    @property
    def rivals(self) -> list[Alternative]:
        """The alternatives that are not this design itself."""
        return [other for other in self.alternatives if other.name != self.realization]
