"""Stimuli of a core: traces from files and scenarios, one per channel."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from sosmith.gen.core import CoreDesign
from sosmith.gen.specification.specification import Specification
from sosmith.gen.stimuli.core import bench_before, bench_of
from sosmith.instrument.scenarios.catalogue import SCENARIOS, emulate
from sosmith.instrument.scenarios.file import emulate_file, load_scenario, range_notes
from sosmith.instrument.scenarios.instrument_signals import least_wear_ramp
from sosmith.instrument.scenarios.summaries import check_scenario
from sosmith.model.errors import SpecificationError
from sosmith.model.foreign_files import read_bytes
from sosmith.model.full_scale import is_sound
from sosmith.model.traces.formats import read_trace_file
from sosmith.model.traces.suffixes import is_trace_file
from sosmith.model.traces.trace import Trace


def default_scenario(design: CoreDesign) -> str:
    """Return the default scenario of a core."""
    if design.quantized.polynomial is not None:
        return "wear_ramp"
    return "passband_sweep" if is_sound(design.datapath.inputs, design.datapath.output) else "sweep"


def traces_for(design: CoreDesign, source: str, *, seed: int, seconds: float | None = None) -> tuple[Trace, ...]:
    """Make a trace for every channel from a CSV or WAV file, a scenario file (TOML) or the name of a scenario.

    Channel k lags channel 0 by k samples and has its own noise, so that all channels differ. A file with all channels
    is used as it is; one with a single channel drives all of them.

    Parameters
    ----------
    design : CoreDesign
        The core.
    source : str
        Path of a file, or name of a scenario.
    seed : int
        Seed of the noise of channel 0; channel k has ``seed + k``.
    seconds : float or None
        Length of a named scenario in s, positive; None for its default length.

    Returns
    -------
    tuple of Trace
        One per channel, all of the same length.

    Raises
    ------
    SpecificationError
        If the file cannot be used, or the scenario does not exist for this core.
    """
    channels = range(design.spec.channels)
    if is_scenario_file(source):
        if seconds is not None:
            raise SpecificationError(f"--seconds must come with a scenario's name, not with the file {source}")
        # With it comes scipy's interpolation, which no other source of traces needs.
        from sosmith.instrument.scenarios.vehicle_clearance import vehicle_clearance  # noqa: PLC0415

        scenario, bench = load_scenario(Path(source)), bench_of(design)
        traces = [emulate_file(scenario, bench, seed=seed + k, channel=k, vehicle=vehicle_clearance) for k in channels]
        return tuple(trace.delayed(k) for k, trace in enumerate(traces))
    if source not in SCENARIOS and (is_trace_file(source) or Path(source).exists()):
        if seconds is not None:
            raise SpecificationError(f"--seconds must come with a scenario, not with the file {source}")
        return read_trace_file(Path(source), design.datapath.inputs, design.spec.sample_rate, len(channels))
    bench = bench_of(design, errors=source == "worst_case_errors")  # an unknown scenario is refused below
    return tuple(emulate(source, bench, seed=seed + k, seconds=seconds).delayed(k) for k in channels)


def is_scenario_file(source: str) -> bool:
    """Whether `source` is the path of a scenario file, not a built-in scenario or a trace."""
    return source not in SCENARIOS and source.lower().endswith(".toml")


def notes_on(design: CoreDesign, source: str) -> tuple[str, ...]:
    """Return a sentence for each part of a scenario file that exceeds an input range; none for other sources.

    Raises
    ------
    SpecificationError
        If the file cannot be used.
    """
    if not is_scenario_file(source):
        return ()
    return range_notes(load_scenario(Path(source)), design.datapath.inputs)


@dataclass(frozen=True)
class ChosenTraces:
    """Traces of one source, one for every channel, as `traces_for` makes them.

    Attributes
    ----------
    source : str or None
        Path of a file, or name of a scenario; the default scenario of a core if None.
    """

    source: str | None = None

    def __call__(self, design: CoreDesign, seed: int, seconds: float) -> tuple[Trace, ...]:
        """Make the traces; of a file, the first `seconds`."""
        source = self.source or default_scenario(design)
        if not self._is_file:
            return traces_for(design, source, seed=seed, seconds=seconds)
        count = round(seconds * float(design.spec.sample_rate))
        return tuple(trace.first(count) for trace in traces_for(design, source, seed=seed))

    @property
    def name(self) -> str | None:
        """Name of the scenario or of the file, wherever it lies; None for the default scenario."""
        return self.source if self.source is None or not self._is_file else Path(self.source).name

    @property
    def _is_file(self) -> bool:
        return self.source is not None and self.source not in SCENARIOS

    def identity(self) -> list[str]:
        """Return what tells these traces from others: nothing by default, a name, or the digest of a file.

        Raises
        ------
        SpecificationError
            If the file cannot be read.
        """
        if self.source is None or not self._is_file:
            return [] if self.source is None else [self.source]
        content = read_bytes(Path(self.source), what="the trace", max_bytes=1 << 30)
        return [hashlib.sha256(content).hexdigest()]

    def check(self, spec: Specification, core: str | None) -> None:
        """Check that a core of this specification can take the traces, before there is a design.

        Raises
        ------
        SpecificationError, ShortfallError
            If it cannot, or as `bench_before`.
        """
        if self.source is None:
            return
        bench = bench_before(spec, core)
        if is_scenario_file(self.source):
            load_scenario(Path(self.source))
        elif is_trace_file(self.source) or Path(self.source).exists():
            read_trace_file(Path(self.source), bench.ports, bench.sample_rate, spec.channels)
        else:
            check_scenario(self.source, bench.kind)

    def least(self, spec: Specification, core: str | None) -> int:
        """Return the lowest number of samples that they can have, before there is a design.

        Raises
        ------
        SpecificationError, ShortfallError
            If the specification has no such core, or its filter cannot be designed.
        """
        bench = bench_before(spec, core)
        ramp = self.source == "wear_ramp" or (self.source is None and bench.polynomial is not None)
        return least_wear_ramp(bench) if ramp else 1
