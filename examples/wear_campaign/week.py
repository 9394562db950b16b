"""A week in service: the sensor ages, the calibration follows, and wear is estimated from the hardware's readings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from examples.wear_campaign import depot, hardware

from sosmith.gen.reload.reload import check_swap, own_set, set_for
from sosmith.gen.specification.specification import load
from sosmith.gen.stimuli.core import bench_of
from sosmith.instrument.calibration.calibration_report import specification_table
from sosmith.instrument.calibration.self_updating import Calibration
from sosmith.instrument.scenarios.file import ScenarioFile, emulate_file
from sosmith.instrument.wear.assessment import WearLimits, WearReport, judge
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.status import Flag
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import EQUATION_5A
from sosmith.model.reference.accuracy import accuracy_percent
from sosmith.model.traces.trace import Trace
from sosmith.sim.simulation import Progress

Values = npt.NDArray[np.float64]

RATE = 100.0
"""Sample rate in Hz, from the paper's section 5.4."""

MAX_ERROR = 0.0005
"""Allowed error in mm of the reloadable hardware with its own coefficients: two LSB."""

SET_ERROR = Fraction(1, 1000)
"""Allowed error in mm with coefficients that are loaded: twice as much, which leaves room for any calibration."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Day:
    """One day. Accuracies are in per cent by equation 7, of the integer model at the readings of the day."""

    day: int
    calibration: Calibration
    factory: float
    first: float
    updated: float
    loaded: str
    true_wear: float
    wear: float
    warnings: int
    readings: int


@dataclass(frozen=True, eq=False, kw_only=True)
class Week:
    """The week, and the wear assessment at its end."""

    days: list[Day]
    report: WearReport
    limits: WearLimits
    time: Values
    clearance: Values
    truth: Values
    simulated: dict[str, Any]


def live(
    scenario: ScenarioFile,
    filter_table: str,
    settings: dict[str, Any],
    seed: int,
    folder: Path,
    simulator: str,
    progress: Progress,
) -> Week:
    """Run the week: each morning depot, refit, proof and reload; then the journeys of the day."""
    calibrations = depot.into_store(scenario, seed, folder, settings["sensor"], settings["method"])
    initial = scenario.document.wear.initial_clearance
    wear = hardware.Wear(initial=initial, warning=settings["warning"], limit=settings["limit"])

    options: dict[str, Any] = {"wear": wear, "reload": True, "max_error": MAX_ERROR}
    factory = hardware.instrument(
        folder, "week_factory", RATE, hardware.calibration_table(EQUATION_5A), filter_table, **options
    )
    trace = emulate_file(scenario, bench_of(factory), seed=seed)
    excerpts = scenario.document.excerpt
    lengths = [round((excerpt.seconds or 0) * RATE) for excerpt in excerpts]
    starts = np.cumsum([0, *lengths])
    days_of = np.repeat([excerpt.day for excerpt in excerpts], lengths)
    within = np.concatenate([np.arange(length) for length in lengths]) / RATE / 86400
    time = days_of + within
    before, days, clearance = own_set(factory), list[Day](), np.zeros(len(trace))
    loaded: list[Datapath] = []
    for number, calibration in enumerate(calibrations):
        table = specification_table(calibration.sensor, calibration.version)
        allowed = options | {"max_error": float(SET_ERROR)}
        wanted = hardware.specification(folder, f"week_day_{number}", RATE, table, filter_table, **allowed)
        progress("week: prove and reload", number, len(calibrations))
        try:
            swap = check_swap(factory, before, set_for(factory, load(wanted)))
            before, verdict = swap.new_set, f"proven, {float(swap.new_set.quantized.bound):.2f} LSB"
            loaded.append(swap.new_set.quantized.datapath)
        except ShortfallError as error:
            verdict = f"refused: {error}"
            loaded.append(loaded[-1] if loaded else factory.datapath)  # keeps the active set
        own = [k for k, excerpt in enumerate(excerpts) if int(excerpt.day) == number]
        span = slice(starts[own[0]], starts[own[-1] + 1])
        part = replace(trace, codes=trace.codes[span], truth=trace.truth[span], reading=trace.reading[span])
        if number == 0:  # one simulated day is enough: the others run the same hardware
            summary = hardware.run(factory, [part], folder, simulator, progress)

        def accuracy(datapath: Datapath, part: Trace = part) -> float:
            values = datapath.output.decode(datapath.compute(part.codes))
            return accuracy_percent(values, part.truth, part.reading)

        datapath = loaded[-1]
        codes = datapath.compute(part.codes)
        clearance[span] = datapath.output.decode(codes)
        flags = datapath.compute_status(part.codes)[part.reading]
        days.append(
            Day(
                day=number,
                calibration=calibration,
                factory=accuracy(factory.datapath),
                first=accuracy(loaded[0]),
                updated=accuracy(datapath),
                loaded=verdict,
                true_wear=float(part.truth[-1]) - initial,
                wear=float(np.median(clearance[span][part.reading])) - initial,
                warnings=int(np.count_nonzero(flags >> Flag.WEAR_WARNING & 1)),
                readings=int(np.count_nonzero(part.reading)),
            )
        )
    limits = WearLimits(initial=initial, limit=wear.limit, warning=wear.warning)
    kept = trace.reading
    report = judge(time[kept], clearance[kept], limits, block=0.25)
    return Week(
        days=days,
        report=report,
        limits=limits,
        time=time[kept],
        clearance=clearance[kept],
        truth=trace.truth[kept],
        simulated=hardware.told(summary),
    )
