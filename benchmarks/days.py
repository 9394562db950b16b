"""Measures what the day's own curve and the wear over days bring: `python -m benchmarks.days`.

The bench with reference targets on the morning of the run, 26 days of service with and without targets and filter, both
in double precision and by the integers of the proven hardware; what is told of jumps and rates, and missed at the
limit; whether plans of `advise` keep their promise, and intervals for sensors that are not as their type. Takes about
half an hour of a processor, shared by two processes. With --document, records it in benchmarks/days.json and renews
docs/days.md; --part measures some parts only and takes the others from the record.

What is measured is kept in the folder -o, each run by itself, with a digest of the code that it was measured by: called
again, the command goes on where it was, and measures anew what the code has changed for. Seeds are given, so that the
record is the same whatever the number of processes.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import multiprocessing
import os
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks import calibration_coverage, day_advice, day_alarms
from benchmarks.day_bench import RUNS, SCENARIOS, hardware_of, one_run
from benchmarks.day_limits import likelihood_ratio
from benchmarks.day_page import page
from benchmarks.day_service import SCENARIO, one_service, without_drift

from sosmith.gen.core import CoreDesign
from sosmith.instrument.scenarios.file import ScenarioFile, load_scenario
from sosmith.model.text_files import write_contents
from sosmith.terminal import show_progress

HERE = Path(__file__).parent
RECORD = HERE / "days.json"
PAGE = HERE.parent / "docs" / "days.md"

SEEDS = 40
"""Runs of each kind on the bench, and axles in service."""

SENSORS = 20
"""Sensors of each kind that is not as its type."""

DOUBTFUL, OF_DOUBTFUL = 0.5, 40
"""Steps in V below which one is hard to tell from the error of a day, and sensors of each of these kinds: chance
decides more there."""

FIRST_SEEDS = {
    "bench": 39001,
    "service": 79101,
    "without drift": 79101,
    "alarms": 69201,
    "advice": 29301,
    "coverage": 39401,
}
"""By none of these seeds was anything chosen; sets that were looked at while building are not among them."""

PROCESSES = 2

_MODEL = ("model/*.py", "model/*/*.py")
_CALIBRATION = ("instrument/calibration/**/*.py", "gen/calibration/*.py", "instrument/sensors/*.py")
_HARDWARE = (
    "benchmarks/day_bench.py",
    "gen/**/*.py",
    *(f"instrument/{room}/**/*.py" for room in ("calibration", "scenarios", "sensors", "uncertainty")),
    "examples/wear_campaign/*.py",
    "examples/scenarios/bench_*.toml",
    *_MODEL,
)
CODE = {
    "bench": _HARDWARE,
    "service": ("benchmarks/day_service.py", "instrument/wear/state_space.py", *_HARDWARE),
    "without drift": ("benchmarks/day_service.py", "instrument/wear/state_space.py", *_HARDWARE),
    "alarms": ("benchmarks/day_alarms.py", "instrument/wear/state_space.py"),
    "advice": ("benchmarks/day_advice.py", "benchmarks/calibration_coverage.py", *_CALIBRATION, *_MODEL),
    "coverage": ("benchmarks/calibration_coverage.py", *_CALIBRATION, *_MODEL),
}
"""Files by which each part is measured, from the folder of the repository."""

Task = tuple[str, Any, int]
"""A part, what of it is measured, and the seed."""


def tasks_of(part: str) -> list[Task]:
    """Return what a part consists of."""
    first = FIRST_SEEDS[part]
    if part == "alarms":
        return [(part, step, first) for step in day_alarms.steps()]
    kinds: dict[str, tuple[Iterable[Any], int]] = {
        "bench": (RUNS, SEEDS),
        "service": (("",), SEEDS),
        "without drift": (("",), SEEDS),
        "advice": (range(len(day_advice.CASES)), day_advice.EACH),
    }
    if part == "coverage":
        return [
            (part, number, seed)
            for number, case in enumerate(calibration_coverage.CASES)
            for seed in range(first, first + (OF_DOUBTFUL if 0 < abs(case.step) < DOUBTFUL else SENSORS))
        ]
    some, seeds = kinds[part]
    return [(part, one, seed) for one in some for seed in range(first, first + seeds)]


@cache
def digest_of(part: str) -> str:
    """Return a digest of the code that measures a part."""
    found = hashlib.sha256()
    for path in sorted({path for pattern in CODE[part] for path in HERE.parent.glob(pattern)}):
        found.update(path.name.encode() + path.read_bytes())
    return found.hexdigest()


@cache
def bench(name: str, folder: Path) -> tuple[ScenarioFile, CoreDesign]:
    """Return a scenario and the hardware that reads it, designed once in a process."""
    scenario = load_scenario(SCENARIOS / f"{name}.toml")
    return scenario, hardware_of(scenario, folder / f"{name}-{os.getpid()}")


def measured_one(task: Task, folder: Path) -> Any:
    """Measure one task."""
    part, what, seed = task
    if part == "bench":
        return list(one_run(*bench(what, folder), seed))
    if part == "service":
        return one_service(*bench(SCENARIO, folder), seed)
    if part == "without drift":
        return without_drift(*bench(SCENARIO, folder), seed)
    if part == "alarms":
        return day_alarms.one_step(what, seed)
    if part == "advice":
        return day_advice.one_case(*day_advice.CASES[what], seed)
    return calibration_coverage.one_sensor(calibration_coverage.CASES[what], seed)


def kept(task: Task, folder: Path) -> Any:
    """Return a task's figures from the folder, or measure them and keep them there."""
    path = folder / task[0] / f"{hashlib.sha256(json.dumps(task).encode()).hexdigest()[:24]}.json"
    code = digest_of(task[0])
    if path.exists():
        found = json.loads(path.read_text(encoding="utf-8"))
        if found["code"] == code:
            return found["figures"]
    figures = measured_one(task, folder)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_contents(path.parent, {path.name: json.dumps({"task": task, "code": code, "figures": figures}).encode()})
    return json.loads(json.dumps(figures))


def _kept(given: tuple[Task, Path]) -> tuple[Task, Any]:
    return given[0], kept(*given)


def measured(parts: list[str], earlier: dict[str, Any], folder: Path, processes: int) -> dict[str, Any]:
    """Return the record, with these parts measured anew."""
    every = [task for part in parts for task in tasks_of(part)]
    rows: dict[Task, Any] = {}
    folder.mkdir(parents=True, exist_ok=True)
    with show_progress() as step, multiprocessing.get_context("spawn").Pool(processes) as pool:
        for number, (task, figures) in enumerate(pool.imap(_kept, [(task, folder) for task in every])):
            step(task[0], number, len(every))
            rows[task] = figures
    found = dict(earlier)
    for part in parts:
        found[part] = _summed(part, {task: rows[task] for task in tasks_of(part)})
    return {part: found[part] for part in FIRST_SEEDS if part in found}


def _summed(part: str, rows: dict[Task, Any]) -> Any:
    if part == "bench":
        return summed([row for some in rows.values() for row in some], ("run", "targets"))
    if part == "service":
        return of_services([row for some in rows.values() for row in some])
    if part == "without drift":
        return summed([row for some in rows.values() for row in some], ("targets", "way"))
    if part == "alarms":
        shares = {str(error): likelihood_ratio(error, FIRST_SEEDS[part]) for error in day_alarms.ERRORS}
        return day_alarms.summed({step: figures for (_, step, _), figures in rows.items()}) | {"by_ratio": shares}
    if part == "advice":
        return list(rows.values())
    return [
        calibration_coverage.summed(case, [figures for (_, k, _), figures in rows.items() if k == number])
        for number, case in enumerate(calibration_coverage.CASES)
    ]


def summed(rows: list[dict[str, Any]], keys: tuple[str, ...]) -> list[dict[str, Any]]:
    """Return the figures of rows that share these keys: means, standard errors, the worst, the largest bound."""
    groups: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault(tuple(row[key] for key in keys), []).append(row)
    found = []
    for key, some in groups.items():
        one: dict[str, Any] = dict(zip(keys, key, strict=True)) | {"count": len(some)}
        for name in ("accuracy", "hardware", "rms", "inside", "inside_hardware", "half_width", "claimed"):
            values = [row[name] for row in some if row.get(name) is not None]
            if values:
                one[name] = round(float(np.mean(values)), 4)
                one[f"{name}_error"] = round(float(np.std(values, ddof=1) / np.sqrt(len(values))), 4)
        one["worst"] = round(min(row["accuracy"] for row in some), 2)
        if "order" in some[0]:
            one["refused"] = sum(row["refused"] for row in some)
            one["sets"] = sum(row["days"] if row["targets"] != "none" else 1 for row in some)
            one["bound"] = max(row["bound"] or 0.0 for row in some)
            one["orders"] = sorted(row["order"] for row in some)
            one["off"] = max(row["off"] for row in some)
        elif "refused" in some[0]:
            one["refused"] = sum(row["refused"] for row in some)
        found.append(one)
    return found


def of_services(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the figures of the services in double precision, with those of the hardware's integers."""
    found, by_hardware = (
        summed([row for row in rows if row["by"] == by], ("targets", "way")) for by in ("double", "hardware")
    )
    own = {(row["seed"], row["targets"], row["way"]): row for row in rows if row["by"] == "hardware"}
    for one, other in zip(found, by_hardware, strict=True):
        alike = [
            row for row in rows if (row["by"], row["targets"], row["way"]) == ("double", one["targets"], one["way"])
        ]
        off = [abs(own[row["seed"], row["targets"], row["way"]]["accuracy"] - row["accuracy"]) for row in alike]
        one |= {"hardware": other["accuracy"], "inside_hardware": other["inside"], "off": round(max(off), 4)}
        one["inside_hardware_error"] = other["inside_error"]
    return found


def main() -> None:
    """Measure; print JSON, or renew the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.days", description=__doc__)
    parser.add_argument("--document", action="store_true", help="record, and renew docs/days.md")
    parser.add_argument("--recorded", action="store_true", help="do not measure: renew the page from the record")
    parser.add_argument("--part", action="append", choices=tuple(FIRST_SEEDS), help="measure this part only")
    parser.add_argument("-o", "--output", type=Path, default=Path("build/days"), help="folder of what is measured")
    parser.add_argument("--processes", type=int, default=PROCESSES, help=f"[default: {PROCESSES}]")
    arguments = parser.parse_args()
    earlier = json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}
    found = earlier
    if not arguments.recorded:
        found = measured(arguments.part or list(FIRST_SEEDS), earlier, arguments.output, arguments.processes)
    text = json.dumps(found, indent=1) + "\n"
    if not (arguments.document or arguments.recorded):
        print(text, end="")
        return
    write_contents(HERE, {RECORD.name: text.encode()})
    write_contents(PAGE.parent, {PAGE.name: page(found).encode()})


if __name__ == "__main__":
    main()
