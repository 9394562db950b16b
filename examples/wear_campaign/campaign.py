"""The steps of the campaign in order; the result is a tree of numbers, and series for the pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from examples.wear_campaign import bench, depot, hardware, ride, week
from examples.wear_campaign.methods import by_the_rule_alone, side_by_side
from examples.wear_campaign.reloads import all_weeks
from examples.wear_campaign.spread import spread
from examples.wear_campaign.wear_intervals import wear_covered

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.specification.specification import load
from sosmith.gen.stimuli.core import bench_of
from sosmith.instrument.calibration.calibration_report import specification_table
from sosmith.instrument.scenarios.file import ScenarioFile, emulate_file, load_scenario
from sosmith.model.polynomial import EQUATION_5A, Polynomial
from sosmith.sim.simulation import Progress

HERE = Path(__file__).parent
SCENARIOS = HERE.parent / "scenarios"

REALIZATION = "df1_ef2"
"""Realization of the hardware that is computed for every seed: quick to design, with the same bound."""


def carry_out(
    settings: dict[str, Any], folder: Path, progress: Progress, *, methods: dict[str, Any] | None = None
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Carry out the whole campaign into `folder`; with `methods`, which do not depend on hardware, all but these."""
    on_bench, bench_series = bench_campaign(settings, folder / "bench", progress)
    on_track, ride_series = ride_campaign(settings, folder / "ride", progress)
    from_spectra = on_track["filters"][-1]["table"]
    in_service, week_series = week_campaign(settings, from_spectra, folder / "week", progress)
    week = load_scenario(SCENARIOS / f"{settings['week']['scenario']}.toml")
    reloads = all_weeks(settings, week, from_spectra, folder / "reloads", progress)
    compared = methods
    if compared is None:
        compared = methods_campaign(settings, from_spectra, folder / "methods", progress)
    results = {
        "settings": settings,
        **compared,
        "bench": on_bench,
        "ride": on_track,
        "week": in_service,
        "reloads": reloads,
    }
    series = {"bench": bench_series, "runs": bench_series, "ride": ride_series, "week": week_series}
    return results, series


def methods_campaign(settings: dict[str, Any], filter_table: str, folder: Path, progress: Progress) -> dict[str, Any]:
    """Fit in different ways, with different true sensors; and count how often the intervals of wear hold."""
    names = [*settings["bench"]["scenarios"], settings["week"]["scenario"]]
    scenarios = {name: load_scenario(SCENARIOS / f"{name}.toml") for name in names}
    compared = side_by_side(settings, scenarios, filter_table, folder, progress)
    rule = by_the_rule_alone(settings, scenarios, folder, progress)
    progress("intervals of wear", 0, 0)
    return {"methods": compared, "rule": rule, "wear": wear_covered()}


def bench_campaign(settings: dict[str, Any], folder: Path, progress: Progress) -> tuple[dict[str, Any], dict[str, Any]]:
    """Run the bench: store, fit, filter from spectra, hardware; then all seeds."""
    own, seed, seeds = settings["bench"], settings["seed"], range(1, settings["seeds"] + 1)
    rows, series = [], {}
    for name in own["scenarios"]:
        scenario = load_scenario(SCENARIOS / f"{name}.toml")
        progress(f"{name}: depot, store and fit", 0, 0)
        versions = depot.into_store(scenario, seed, folder / name, "bench")
        table = specification_table("bench", versions[-1].version)
        paper = hardware.instrument(folder / name, f"{name}_paper", own["sample_rate"], table, bench.PAPER_FILTER)
        progress(f"{name}: filter from spectra", 0, 0)
        _, proposed = bench.from_spectra(scenario, paper, seed, own["tolerance"], own["passband_edge"])
        spectra = hardware.instrument(folder / name, f"{name}_spectra", own["sample_rate"], table, proposed)
        for title, made, filter_table in (
            ("the paper's", paper, bench.PAPER_FILTER),
            ("from spectra", spectra, proposed),
        ):
            label = f"{name}, {title} filter"
            summary = bench.through_hardware(scenario, made, seed, folder / name, settings["simulator"], progress)

            def design_for(polynomial: Polynomial, table: str = filter_table, own_name: str = name) -> CoreDesign:
                calibration = hardware.calibration_table(polynomial)
                path = hardware.specification(folder / own_name, "one_of_many", own["sample_rate"], calibration, table)
                return design_core(load(path), realization=REALIZATION)

            runs = bench.over_seeds(
                scenario, made, seeds, lambda done, label=label: progress(label, done, len(seeds)), design_for
            )
            rows.append(_bench_row(scenario, title, made, runs, summary, settings["confidence"]))
        trace = emulate_file(scenario, bench_of(paper), seed=seed)
        series[name] = bench.signals(trace, paper)
    others = []
    for name in own["others"]:
        scenario = load_scenario(SCENARIOS / f"{name}.toml")
        runs = bench.over_seeds(scenario, paper, seeds, lambda done, name=name: progress(name, done, len(seeds)))
        others.append(_bench_row(scenario, "the paper's", paper, runs, None, settings["confidence"]))
    causes = {}
    for name in [*own["scenarios"], *own["others"]]:
        scenario = load_scenario(SCENARIOS / f"{name}.toml")
        progress(f"{name}: sources of error", 0, 0)
        found = bench.sources(scenario, paper, seeds)
        causes[name] = {what: spread(values, settings["confidence"]) for what, values in found.items()}
    return {"runs": rows, "others": others, "causes": causes}, series


def _bench_row(
    scenario: ScenarioFile,
    title: str,
    made: CoreDesign,
    runs: list[bench.Run],
    summary: dict[str, Any] | None,
    confidence: float,
) -> dict[str, Any]:
    integers = [run.hardware for run in runs if run.hardware is not None]
    return {
        "scenario": scenario.path.stem,
        "description": scenario.document.description,
        "filter": title,
        "describe": made.quantized.filter.describe,
        "unfiltered": spread([run.unfiltered for run in runs], confidence),
        "golden": spread([run.golden for run in runs], confidence),
        "hardware": spread(integers, confidence) if integers else None,
        "hardware_off": max(abs(run.hardware - run.golden) for run in runs) if integers else None,
        "adjusted_r": spread([run.adjusted_r for run in runs], confidence),
        "by_orders": [
            {"orders": list(orders), "seeds": len(some), "golden": sum(run.golden for run in some) / len(some)}
            for orders in sorted({run.orders for run in runs})
            for some in [[run for run in runs if run.orders == orders]]
        ],
        "values": [[run.unfiltered, run.golden] for run in runs],
        "simulated": None if summary is None else hardware.told(summary),
    }


def ride_campaign(settings: dict[str, Any], folder: Path, progress: Progress) -> tuple[dict[str, Any], dict[str, Any]]:
    """Run three filters over the rides."""
    own, seed = settings["ride"], settings["seed"]
    scenarios = [load_scenario(HERE / f"{name}.toml") for name in own["scenarios"]]
    calibration, rate = hardware.calibration_table(EQUATION_5A), own["sample_rate"]
    progress("ride: vehicle and spectra", 0, 0)
    paper = hardware.instrument(folder, "ride_paper", rate, calibration, ride.PAPER_FILTER)
    straight = [scenario for scenario in scenarios if scenario.path.stem in own["proposed_from"]]
    _, table = ride.from_spectra(straight, bench_of(paper), seed, own["lead_in"], own["tolerance"])
    exact = ride.prewarped(own["order"], own["passband_edge"], own["passband_loss"], rate)
    made = [
        ("the paper's 7th order", ride.PAPER_FILTER, paper),
        ("pre-warped 10 Hz", exact, hardware.instrument(folder, "ride_prewarped", rate, calibration, exact)),
        ("from spectra", table, hardware.instrument(folder, "ride_spectra", rate, calibration, table)),
    ]
    results = [
        ride.ride(title, scenario, core, seed, own["lead_in"], folder, settings["simulator"], progress)
        for scenario in scenarios
        for title, _, core in made
    ]
    kept = ("filter", "scenario", "rms_before", "rms_after", "max_before", "max_after", "mean_after", "accuracy_before")
    rows = [
        {name: getattr(result, name) for name in kept}
        | {"accuracy_golden": result.accuracy_golden, "accuracy_hardware": result.accuracy_hardware}
        | {"simulated": hardware.told(result.summary)}
        for result in results
    ]
    filters = [
        {
            "filter": title,
            "describe": core.quantized.filter.describe,
            "table": table,
            "delay": result.delay,
            "settling": result.settling,
            "attenuation": result.attenuation,
        }
        for (title, table, core), result in zip(made, results, strict=False)
    ]
    return {"filters": filters, "runs": rows, "validity": ride.validity(rate)}, {"results": results, "clearance": 5.0}


def week_campaign(
    settings: dict[str, Any], filter_table: str, folder: Path, progress: Progress
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Run the week in service."""
    own = settings["week"]
    scenario = load_scenario(SCENARIOS / f"{own['scenario']}.toml")
    found = week.live(scenario, filter_table, own, settings["seed"], folder, settings["simulator"], progress)
    days = [
        {
            "day": day.day,
            "measurements": day.calibration.version.measurements,
            "orders": list(day.calibration.fit.orders),
            "adjusted_r": day.calibration.fit.adjusted_r,
            "accuracy": {"factory": day.factory, "first": day.first, "updated": day.updated},
            "loaded": day.loaded,
            "wear": day.wear,
            "true_wear": day.true_wear,
            "warnings": day.warnings,
            "readings": day.readings,
        }
        for day in found.days
    ]
    report, rate = found.report, found.report.rate
    told = {
        "wear": report.wear,
        "rate": [rate.rate, rate.low, rate.high],
        "life": [report.life, report.life_low, report.life_high],
        "state": str(report.state),
        "warning": found.limits.warning,
        "limit": found.limits.limit,
        "initial": found.limits.initial,
    }
    return {"days": days, "told": told, "simulated": found.simulated}, {"week": found}
