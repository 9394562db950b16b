"""The reloads of all weeks: each morning's calibration by `bayes` is proven before it is loaded, or refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from examples.wear_campaign import hardware
from examples.wear_campaign.methods import PRIOR, RATE, measured, until, with_sensor
from examples.wear_campaign.week import MAX_ERROR, SET_ERROR

from sosmith.gen.core import CoreDesign
from sosmith.gen.reload.reload import check_swap, other_set, own_set
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES
from sosmith.instrument.calibration.bayesian_fit import bayesian_fit
from sosmith.instrument.scenarios.file import ScenarioFile
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.polynomial import EQUATION_5A
from sosmith.sim.simulation import Progress


def one_week(core: CoreDesign, scenario: ScenarioFile, seed: int) -> list[dict[str, Any]]:
    """Return what comes of each morning's reload in a week, in turn.

    Each has a `verdict`: ``proven``, with the bound in mm; ``refused``, with the reason,
    and ``no fit``, where no polynomial was made. After the latter two the hardware keeps its active set, and the next
    swap starts from that.
    """
    rows, active, mornings = measured(scenario, seed), own_set(core), []
    first = scenario.document.start.toordinal()
    lsb = core.datapath.output.lsb
    for day in sorted({int(excerpt.day) for excerpt in scenario.document.excerpt}):
        date = first + day
        try:
            made = bayesian_fit(until(rows, date), PRIOR, date, DEFAULT_RANGES)
            swap = check_swap(core, active, other_set(core, polynomial=made.fit.polynomial, max_error=SET_ERROR))
        except SpecificationError as error:
            mornings.append({"verdict": "no fit", "reason": str(error)})
        except ShortfallError as error:
            mornings.append({"verdict": "refused", "reason": str(error)})
        else:
            active = swap.new_set
            bound = round(float(active.quantized.bound * lsb), 9)
            mornings.append({"verdict": "proven", "bound": bound})
    return mornings


def all_weeks(
    settings: dict[str, Any], scenario: ScenarioFile, filter_table: str, folder: Path, progress: Progress
) -> list[dict[str, Any]]:
    """Return the counts of all weeks for each true sensor, with the largest bound in mm."""
    own = settings["week"]
    wear = hardware.Wear(warning=own["warning"], limit=own["limit"])
    options: dict[str, Any] = {"wear": wear, "reload": True, "max_error": MAX_ERROR}
    calibration = hardware.calibration_table(EQUATION_5A)
    core = hardware.instrument(folder, "reloads", RATE, calibration, filter_table, **options)
    sensors, seeds = settings["methods"]["sensors"], settings["seeds"]
    found = []
    for k, sensor in enumerate(sensors):
        mornings: list[dict[str, Any]] = []
        for seed in range(1, seeds + 1):
            progress(f"reloads: {sensor}", k * seeds + seed, len(sensors) * seeds)
            mornings += one_week(core, with_sensor(scenario, sensor), seed)
        found.append({"sensor": sensor, **counted(mornings)})
    return found


def counted(mornings: list[dict[str, Any]]) -> dict[str, Any]:
    """Return how many mornings have each verdict, the extremes of the proven ones, and the reasons of the others."""
    proven = [one for one in mornings if one["verdict"] == "proven"]
    return {
        "mornings": len(mornings),
        "proven": len(proven),
        "bound": max((one["bound"] for one in proven), default=None),
        "kept": [f"{one['verdict']}: {one['reason']}" for one in mornings if one["verdict"] != "proven"],
    }
