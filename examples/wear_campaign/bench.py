"""The paper's bench runs (section 3.3), over many seeds and in the simulated hardware."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from examples.wear_campaign import depot, hardware

from sosmith.gen.core import CoreDesign
from sosmith.gen.stimuli.core import bench_of
from sosmith.instrument.scenarios.catalogue import Bench
from sosmith.instrument.scenarios.depot_measurements import measurements_of
from sosmith.instrument.scenarios.file import ScenarioFile, emulate_file
from sosmith.instrument.sensors.inductive_sensor import SystematicError
from sosmith.instrument.spectrum.filter_table import filter_table
from sosmith.instrument.spectrum.proposal import Content, Proposal, propose
from sosmith.instrument.spectrum.settings import SpectrumSettings, Wish
from sosmith.instrument.spectrum.spectra import spectrum
from sosmith.model.polynomial import EQUATION_5A, Polynomial
from sosmith.model.reference.accuracy import accuracy_percent
from sosmith.model.reference.golden import calibrated, filtered
from sosmith.model.traces.trace import Trace
from sosmith.sim.simulation import Progress

Values = npt.NDArray[np.float64]

PAPER_FILTER = hardware.filter_by_order(5, 0.5751308)
"""Filter of the paper's equations 16 to 19; examples/flange_wear_bench.toml derives its cutoff."""


@dataclass(frozen=True)
class Run:
    """Accuracies of one bench run, in per cent by equation 7."""

    seed: int
    unfiltered: float
    golden: float
    hardware: float | None
    adjusted_r: float
    orders: tuple[int, int]


def without(scenario: ScenarioFile, *what: str) -> ScenarioFile:
    """Return the scenario without some of ``noise`` (of both sensors), ``systematic``."""
    sensors = scenario.sensors
    if "noise" in what:
        quiet = replace(sensors.thermometer, noise=0.0)
        sensors = replace(sensors, inductive=replace(sensors.inductive, noise=0.0), thermometer=quiet)
    if "systematic" in what:
        sensors = replace(sensors, inductive=replace(sensors.inductive, systematic_error=SystematicError()))
    return replace(scenario, sensors=sensors)


def accuracies(
    scenario: ScenarioFile, bench: Bench, made: CoreDesign, seed: int, polynomial: Polynomial
) -> tuple[float, float]:
    """Return the accuracy before and after the ideal filter."""
    trace = emulate_file(scenario, bench, seed=seed)
    raw = calibrated(trace.codes, bench.ports, polynomial)
    smooth = filtered(raw, made.quantized.filter.sos, bench.output, steady=made.quantized.steady)
    return accuracy_percent(raw, trace.truth, trace.reading), accuracy_percent(smooth, trace.truth, trace.reading)


def over_seeds(
    scenario: ScenarioFile,
    made: CoreDesign,
    seeds: range,
    progress: Callable[[int], None],
    design_for: Callable[[Polynomial], CoreDesign] | None = None,
) -> list[Run]:
    """Run the bench for each seed: depot, fit, trace, filter and, on request, the hardware's integer model."""
    bench, runs = bench_of(made), []
    for seed in seeds:
        fit = depot.fitted(measurements_of(scenario, seed))
        raw, golden = accuracies(scenario, bench, made, seed, fit.polynomial)
        integers = None
        if design_for is not None:
            datapath = design_for(fit.polynomial).datapath
            trace = emulate_file(scenario, bench, seed=seed)
            clearance = datapath.output.decode(datapath.compute(trace.codes))
            integers = accuracy_percent(clearance, trace.truth, trace.reading)
        runs.append(Run(seed, raw, golden, integers, fit.adjusted_r, fit.orders))
        progress(len(runs))
    return runs


def sources(scenario: ScenarioFile, made: CoreDesign, seeds: range) -> dict[str, list[float]]:
    """Return the accuracy after the filter for each seed, with one source of error removed at a time."""
    bench = bench_of(made)
    found: dict[str, list[float]] = {}
    for seed in seeds:
        fit = depot.fitted(measurements_of(scenario, seed)).polynomial
        for name, changed, polynomial in (
            ("all errors", scenario, fit),
            ("no noise", without(scenario, "noise"), fit),
            ("no systematic error of the run", without(scenario, "systematic"), fit),
            ("equation 5a instead of the fit", scenario, EQUATION_5A),
            ("noise alone", without(scenario, "systematic"), EQUATION_5A),
            ("converters alone", without(scenario, "noise", "systematic"), EQUATION_5A),
        ):
            found.setdefault(name, []).append(accuracies(changed, bench, made, seed, polynomial)[1])
    return found


def from_spectra(
    scenario: ScenarioFile, made: CoreDesign, seed: int, tolerance: float, passband: float
) -> tuple[Proposal, str]:
    """Propose a filter from the spectra of an unfiltered run; return it with its table."""
    bench = bench_of(made)
    trace = emulate_file(scenario, bench, seed=seed)
    raw = calibrated(trace.codes, bench.ports, made.quantized.polynomial)
    rate, settings = float(bench.sample_rate), SpectrumSettings()
    content = Content(
        name=trace.name,
        wanted=spectrum(trace.truth, rate, settings),
        disturbance=spectrum(raw - trace.truth, rate, settings),
        has_truth=True,
    )
    proposal = propose([content], Wish(tolerance=tolerance, passband=passband), rate)
    return proposal, filter_table(proposal, [f"{scenario.path.name}, seed {seed}", f"tolerance {tolerance} mm"])


def through_hardware(
    scenario: ScenarioFile, made: CoreDesign, seed: int, folder: Path, simulator: str, progress: Progress
) -> dict[str, Any]:
    """Run one seed in the generated hardware."""
    return hardware.run(made, [emulate_file(scenario, bench_of(made), seed=seed)], folder, simulator, progress)


def signals(trace: Trace, made: CoreDesign) -> dict[str, Values]:
    """Return time in s and clearances in mm of a run: true, measured, and filtered."""
    bench = bench_of(made)
    raw = calibrated(trace.codes, bench.ports, made.quantized.polynomial)
    smooth = filtered(raw, made.quantized.filter.sos, bench.output, steady=made.quantized.steady)
    return {"time": trace.time, "true": trace.truth, "measured": raw, "filtered": smooth}
