"""The vehicle on track: the effect of its motion on the measurement, and how well three filters remove it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from examples.wear_campaign import hardware
from scipy import signal

from sosmith.gen.core import CoreDesign
from sosmith.gen.filter.design import prewarp, unwarp
from sosmith.gen.filter.response import group_delay, magnitude_db
from sosmith.gen.stimuli.core import bench_of
from sosmith.instrument.scenarios.catalogue import Bench
from sosmith.instrument.scenarios.file import ScenarioFile, emulate_file
from sosmith.instrument.scenarios.vehicle_clearance import IRREGULARITY, SPEED, WHEELSET, vehicle_clearance
from sosmith.instrument.spectrum.filter_table import filter_table
from sosmith.instrument.spectrum.proposal import Content, Proposal, propose
from sosmith.instrument.spectrum.settings import SpectrumSettings, Wish
from sosmith.instrument.spectrum.spectra import spectrum
from sosmith.instrument.vehicle.limits import limits
from sosmith.instrument.vehicle.parameters import built_in
from sosmith.instrument.vehicle.run import run
from sosmith.instrument.vehicle.track import curved_track, tangent_track
from sosmith.model.polynomial import EQUATION_5A
from sosmith.model.reference.accuracy import accuracy_percent
from sosmith.model.reference.golden import calibrated, filtered
from sosmith.model.traces.trace import Trace
from sosmith.sim.simulation import Progress

Values = npt.NDArray[np.float64]

PAPER_FILTER = hardware.filter_by_order(7, 0.2587802)
"""Filter of the paper's tables 9 and 10; examples/flange_wear_locomotive.toml derives its cutoff."""

MODEL = "nonlinear"
"""Model of the contacts of wheels and rails that the recorded campaign rides on."""

SETTLED = 0.01
"""Remaining fraction of a step at which the filter counts as settled."""

NOTABLE = {"hunting": 1.2, "irregularity": 2.0, "the paper's passband edge": 10.0}
"""Frequencies in Hz for which the attenuation is shown: bogie mode, and the paper's 10 m irregularity at 20 m/s."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Result:
    """One filter on one ride. Errors are in mm against the true clearance, without the lead-in."""

    filter: str
    describe: str
    scenario: str
    rms_before: float
    rms_after: float
    max_before: float
    max_after: float
    mean_after: float
    accuracy_before: float
    accuracy_golden: float
    accuracy_hardware: float
    delay: float
    settling: float
    attenuation: dict[str, float]
    summary: dict[str, Any]
    time: Values
    before: Values
    after: Values


def prewarped(order: int, edge: float, loss: float, sample_rate: float) -> str:
    """Return the table ``[filter]`` of the Butterworth low-pass with `loss` dB at `edge` Hz, by equations 10 and 13."""
    analog = prewarp(edge, sample_rate) / (10 ** (0.1 * loss) - 1) ** (1 / (2 * order))
    return hardware.filter_by_order(order, float(f"{unwarp(analog, sample_rate):.9g}"))


def trace_of(scenario: ScenarioFile, bench: Bench, seed: int, lead_in: float) -> Trace:
    """Generate the trace; every sample after the first `lead_in` seconds, in which filters settle, is a reading."""
    trace = emulate_file(scenario, bench, seed=seed, vehicle=partial(vehicle_clearance, model=MODEL))
    return replace(trace, reading=trace.time >= lead_in)


def from_spectra(
    scenarios: list[ScenarioFile], bench: Bench, seed: int, lead_in: float, tolerance: float
) -> tuple[Proposal, str]:
    """Propose a filter from the true and measured spectra of the rides; return it with its table."""
    contents, rate, settings = [], float(bench.sample_rate), SpectrumSettings()
    for scenario in scenarios:
        trace = trace_of(scenario, bench, seed, lead_in)
        ride = trace.reading
        measured = calibrated(trace.codes, bench.ports, EQUATION_5A)
        contents.append(
            Content(
                name=trace.name,
                wanted=spectrum(trace.truth[ride], rate, settings),
                disturbance=spectrum((measured - trace.truth)[ride], rate, settings),
                has_truth=True,
            )
        )
    proposal = propose(contents, Wish(tolerance=tolerance), rate)
    names = [f"{scenario.path.name}, seed {seed}" for scenario in scenarios]
    return proposal, filter_table(proposal, [*names, f"tolerance {tolerance} mm"])


def ride(
    name: str,
    scenario: ScenarioFile,
    made: CoreDesign,
    seed: int,
    lead_in: float,
    folder: Path,
    simulator: str,
    progress: Progress,
) -> Result:
    """Run one filter on one ride: in double precision and in the generated hardware."""
    bench = bench_of(made)
    trace, ideal = trace_of(scenario, bench, seed, lead_in), made.quantized.filter
    before = calibrated(trace.codes, bench.ports, EQUATION_5A)
    after = filtered(before, ideal.sos, bench.output, steady=made.quantized.steady)
    summary = hardware.run(made, [trace], folder / scenario.path.stem, simulator, progress)
    error = [(values - trace.truth)[trace.reading] for values in (before, after)]
    rate = float(bench.sample_rate)
    step = signal.sosfilt(ideal.sos, np.ones(round(200 * rate)))
    late = np.flatnonzero(np.abs(step - 1) > SETTLED)
    return Result(
        filter=name,
        describe=ideal.describe,
        scenario=scenario.path.stem,
        rms_before=float(np.sqrt(np.mean(error[0] ** 2))),
        rms_after=float(np.sqrt(np.mean(error[1] ** 2))),
        max_before=float(np.max(np.abs(error[0]))),
        max_after=float(np.max(np.abs(error[1]))),
        mean_after=float(np.mean(error[1])),
        accuracy_before=accuracy_percent(before, trace.truth, trace.reading),
        accuracy_golden=summary["accuracy_percent"]["golden"],
        accuracy_hardware=summary["accuracy_percent"]["hardware"],
        delay=float(group_delay(ideal.sos, np.zeros(1), rate)[0]),
        settling=(int(late[-1]) + 1) / rate,
        attenuation={
            what: -float(magnitude_db(ideal.sos, np.array([frequency]), rate)[0]) for what, frequency in NOTABLE.items()
        },
        summary=summary,
        time=trace.time,
        before=before,
        after=after,
    )


def validity(sample_rate: float) -> dict[str, float | bool | str]:
    """Return how far the leading wheelset goes on the curve: mm beyond flange contact, share of friction, Y/Q."""
    parameters = built_in()
    track = curved_track(parameters.track)
    settings: dict[str, Any] = {"speed": SPEED, "sample_rate": sample_rate, "irregularity": IRREGULARITY, "seed": 1}
    motion = run(parameters, track, **settings, model=MODEL)
    found = limits(parameters, track, motion)
    straight = tangent_track(replace(parameters.track, irregularity=0.0))
    tangent = run(parameters, straight, **settings, model=MODEL)
    return {
        "model": MODEL,
        "tangent_kept": limits(parameters, straight, tangent).kept,
        "beyond_flange": 1e3 * float(found.beyond_flange[WHEELSET]),
        "beyond_share": float(found.beyond_flange_share[WHEELSET]),
        "friction_used": float(found.friction_used[WHEELSET]),
        "derailment_quotient": float(found.derailment_quotient[WHEELSET]),
    }
