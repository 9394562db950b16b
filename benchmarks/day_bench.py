"""The paper's bench with reference targets on the morning of the run: a part of `python -m benchmarks.days`.

For each seed the depot measures on the ten days before; in the morning some targets are read, each off its nominal
clearance by its own uncertainty; the calibration is fitted to all of it, loaded into hardware that exists, with the
proof, and the run is evaluated with it, in double precision and in the integers of the hardware.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from examples.wear_campaign import hardware
from examples.wear_campaign.bench import PAPER_FILTER
from examples.wear_campaign.methods import PRIOR, Made, Worth, judged, measured, measured_by

from sosmith.gen.calibration.fit import Measurements
from sosmith.gen.core import CoreDesign
from sosmith.gen.reload.reload import check_swap, other_set
from sosmith.gen.stimuli.core import bench_of
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES
from sosmith.instrument.calibration.bayesian_fit import BayesianFit, bayesian_fit
from sosmith.instrument.calibration.coefficient_covariance import of_bayes
from sosmith.instrument.calibration.uncertainty import of_posterior
from sosmith.instrument.scenarios.file import ScenarioFile, emulate_file, load_scenario
from sosmith.instrument.sensors.inductive_sensor import InductiveState
from sosmith.model.arithmetic.random_streams import streams
from sosmith.model.errors import ShortfallError
from sosmith.model.reference.accuracy import accuracy_percent

SCENARIOS = Path(__file__).parents[1] / "examples" / "scenarios"
RUNS = ("bench_43_50", "bench_92_96")

TARGETS: dict[str, tuple[float, ...]] = {
    "none": (),
    "three": (1.5, 3.5, 7.0),
    "five": (1.5, 3.0, 5.0, 7.0, 9.0),
}
"""Clearances in mm of the targets. The lowest is beyond the sensor's rail at the depot's temperature, which is at
1.1 mm without an error of the day; the lower half is read more densely, since the paper's accuracy is relative."""

KNOWN_TO = 0.02
"""Standard uncertainty of a target in mm."""

MORNING = 20.0
"""Temperature in degC at which targets are read: that of the depot, not that of the run."""

ORDER = 6
"""Highest order in the voltage that the hardware has room for."""

TYPE = replace(PRIOR, order=ORDER)

RATE = 6.0
"""Sample rate in Hz, the paper's section 4."""

UNCERTAINTY = {"noise": 0.048, "temperature": 0.3, "voltage": 0.0, "clearance_rate": 0.0}
"""What is stated of the instrument, as in examples/wear_campaign/campaign.toml."""

MAX_ERROR, SET_ERROR = 0.0005, Fraction(1, 1000)
"""Allowed error in mm of the hardware as it is made, and with a set that is loaded."""

FACTORY_SEED = 8999
"""Of the sensor whose day the hardware is made with: its own curve is of the highest order."""


def with_targets(
    known: Measurements,
    scenario: ScenarioFile,
    state: InductiveState,
    date: int,
    clearances: tuple[float, ...],
    seed: int,
) -> Measurements:
    """Return measurements with the readings of targets on the day `date`, when the sensor is in `state`."""
    if not clearances:
        return known
    nominal = np.array(clearances)
    true = nominal + streams(seed, "targets")(f"day {date}").normal(0.0, KNOWN_TO, len(nominal))
    temperature = np.full(len(nominal), MORNING)
    voltage = scenario.sensors.inductive.steady_voltage(true, temperature, state)
    before = np.zeros((3, len(known))) if known.uncertainty is None else known.uncertainty
    own = np.zeros((3, len(nominal)))
    own[0] = KNOWN_TO
    return Measurements(
        np.concatenate((known.clearance, nominal)),
        np.concatenate((known.voltage, voltage)),
        np.concatenate((known.temperature, scenario.sensors.thermometer.steady(temperature))),
        known.source,
        (*known.days, *[date] * len(nominal)),
        np.concatenate((before, own), axis=1),
    )


def calibrated(scenario: ScenarioFile, seed: int, clearances: tuple[float, ...]) -> tuple[Measurements, BayesianFit]:
    """Return the measurements of the days before with those of the morning, and the calibration for the run."""
    (excerpt,) = scenario.document.excerpt
    date = scenario.document.start.toordinal() + int(excerpt.day)
    state = scenario.sensors.inductive.state(excerpt.day, streams(seed, "life of the sensor"))
    every = with_targets(measured(scenario, seed), scenario, state, date, clearances, seed)
    return every, bayesian_fit(every, TYPE, date, DEFAULT_RANGES)


def hardware_of(scenario: ScenarioFile, folder: Path) -> CoreDesign:
    """Design hardware with room for the highest order, to which calibrations are loaded."""
    _, made = calibrated(scenario, FACTORY_SEED, TARGETS["five"])
    table = hardware.calibration_table(made.fit.polynomial)
    stated = hardware.uncertainty_table(UNCERTAINTY)
    return hardware.instrument(
        folder, "day", RATE, table, PAPER_FILTER, reload=True, max_error=MAX_ERROR, uncertainty=stated
    )


def one_run(scenario: ScenarioFile, core: CoreDesign, seed: int) -> Iterator[dict[str, Any]]:
    """Yield the figures of one run for each number of targets."""
    trace = emulate_file(scenario, bench_of(core), seed=seed)
    for name, clearances in TARGETS.items():
        measurements, made = calibrated(scenario, seed, clearances)
        worth = Worth(of_bayes(measurements, made), of_posterior(measurements, made).half_width)
        polynomial = made.fit.polynomial
        found = judged(Made(polynomial, polynomial.orders[0], worth, made.plain), trace, core)
        _, _, smooth = measured_by(Made(polynomial, polynomial.orders[0]), trace, core)
        off = (smooth - trace.truth)[trace.reading]
        row = {"run": scenario.path.stem, "targets": name, "seed": seed, "order": polynomial.orders[0]}
        row |= {key: round(found[key], 4) for key in ("accuracy", "inside", "half_width")}
        row |= {"rms": round(float(np.sqrt(np.mean(off**2))), 4)}
        yield row | loaded(core, made, trace)


def loaded(core: CoreDesign, made: BayesianFit, trace: Any) -> dict[str, Any]:
    """Load a calibration into the hardware: its accuracy in integers and proven bound, or why it is refused."""
    try:
        swap = check_swap(core, None, other_set(core, polynomial=made.fit.polynomial, max_error=SET_ERROR))
    except ShortfallError as error:
        return {"hardware": None, "refused": str(error)}
    datapath = swap.new_set.quantized.datapath
    clearance = datapath.output.decode(datapath.compute(trace.codes))
    bound = float(swap.new_set.quantized.bound * datapath.output.lsb)
    return {
        "hardware": round(accuracy_percent(clearance, trace.truth, trace.reading), 4),
        "bound": round(bound, 7),
    }


def all_runs(seeds: range, folder: Path, progress: Callable[[str, int, int], None]) -> list[dict[str, Any]]:
    """Return the figures of all runs."""
    rows: list[dict[str, Any]] = []
    for number, name in enumerate(RUNS):
        scenario = load_scenario(SCENARIOS / f"{name}.toml")
        core = hardware_of(scenario, folder / name)
        for k, seed in enumerate(seeds):
            progress(f"bench: {name}", number * len(seeds) + k, len(RUNS) * len(seeds))
            rows += one_run(scenario, core, seed)
    return rows
