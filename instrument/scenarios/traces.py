"""Stimuli of a core: traces from files and scenarios, one per channel."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sosmith.gen.core import CoreDesign
from sosmith.gen.specification.specification import Specification
from sosmith.gen.stimuli.core import bench_before, bench_of
from sosmith.instrument.scenarios.catalogue import SCENARIOS, emulate
from sosmith.instrument.scenarios.file import emulate_file, load_scenario, range_notes
from sosmith.instrument.scenarios.instrument_signals import least_wear_ramp
from sosmith.instrument.scenarios.vehicle_clearance import vehicle_clearance
from sosmith.model.errors import SpecificationError
from sosmith.model.traces.trace import Trace
from sosmith.model.traces.trace_file import read_traces


def default_scenario(design: CoreDesign) -> str:
    """Return the default scenario of a core."""
    return "sweep" if design.quantized.polynomial is None else "wear_ramp"


def traces_for(design: CoreDesign, source: str, *, seed: int, seconds: float | None = None) -> tuple[Trace, ...]:
    """Make a trace for every channel from a CSV file, a scenario file (TOML) or the name of a scenario.

    Channel k lags channel 0 by k samples and has its own noise, so that all channels differ. A CSV file with a column
    `channel` is used as it is; one without it drives all channels.

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
        scenario, bench = load_scenario(Path(source)), bench_of(design)
        traces = [emulate_file(scenario, bench, seed=seed + k, channel=k, vehicle=vehicle_clearance) for k in channels]
        return tuple(trace.delayed(k) for k, trace in enumerate(traces))
    if source not in SCENARIOS and (source.lower().endswith(".csv") or Path(source).exists()):
        if seconds is not None:
            raise SpecificationError(f"--seconds must come with a scenario, not with the file {source}")
        given = read_traces(Path(source), design.datapath.inputs, design.spec.sample_rate, len(channels))
        return given if len(given) == len(channels) else tuple(given[0].delayed(k) for k in channels)
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
class DefaultTraces:
    """Traces of the default scenario, one for every channel, as `traces_for` makes them."""

    def __call__(self, design: CoreDesign, seed: int, seconds: float) -> tuple[Trace, ...]:
        """Make the traces."""
        return traces_for(design, default_scenario(design), seed=seed, seconds=seconds)

    def least(self, spec: Specification, core: str | None) -> int:
        """Return the lowest number of samples that they can have, before there is a design.

        Raises
        ------
        SpecificationError, ShortfallError
            If the specification has no such core, or its filter cannot be designed.
        """
        bench = bench_before(spec, core)
        return 1 if bench.polynomial is None else least_wear_ramp(bench)
