"""Measures what the day's own curve and the wear over days bring: `python -m benchmarks.days`.

The bench with reference targets on the morning of the run, 26 days of service with and without targets and filter, both
in double precision and by the integers of the proven hardware; what is told of jumps and rates, and missed at the
limit; whether plans of `advise` keep their promise, and intervals for sensors that are not as
their type. Takes about half an hour of processor time. With --document,
records it in benchmarks/days.json and renews docs/days.md; --part measures one part anew and takes the others from
the record.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.calibration_coverage import all_sensors
from benchmarks.day_advice import all_cases
from benchmarks.day_alarms import all_alarms
from benchmarks.day_bench import all_runs
from benchmarks.day_page import page
from benchmarks.day_service import all_services

from sosmith.model.text_files import write_contents
from sosmith.terminal import show_progress

HERE = Path(__file__).parent
RECORD = HERE / "days.json"
PAGE = HERE.parent / "docs" / "days.md"

SEEDS = 40
"""Runs of each kind on the bench, and axles in service."""

SENSORS = 20
"""Sensors of each kind that is not as its type."""

FIRST_SEEDS = {"bench": 9001, "service": 9101, "alarms": 9201, "advice": 9301, "coverage": 9401}
"""None of these seeds was used while building."""


def measured(parts: list[str], earlier: dict[str, Any], folder: Path, step: Callable[[str, int, int], None]) -> Any:
    """Return the record, with these parts measured anew."""
    found = dict(earlier)
    seeds = {name: range(first, first + SEEDS) for name, first in FIRST_SEEDS.items()}
    if "bench" in parts:
        found["bench"] = summed(all_runs(seeds["bench"], folder, step), ("run", "targets"))
    if "service" in parts:
        found["service"] = of_services(all_services(seeds["service"], folder, step))
    if "alarms" in parts:
        found["alarms"] = all_alarms(FIRST_SEEDS["alarms"], step)
    if "advice" in parts:
        found["advice"] = all_cases(FIRST_SEEDS["advice"], step)
    if "coverage" in parts:
        found["coverage"] = all_sensors(range(FIRST_SEEDS["coverage"], FIRST_SEEDS["coverage"] + SENSORS), step)
    return found


def summed(rows: list[dict[str, Any]], keys: tuple[str, ...]) -> list[dict[str, Any]]:
    """Return the figures of rows that share these keys: means, standard errors, the worst, the largest bound."""
    groups: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault(tuple(row[key] for key in keys), []).append(row)
    found = []
    for key, some in groups.items():
        one: dict[str, Any] = dict(zip(keys, key, strict=True)) | {"count": len(some)}
        for name in ("accuracy", "hardware", "rms", "inside", "half_width"):
            values = [row[name] for row in some if row.get(name) is not None]
            if values:
                one[name] = round(float(np.mean(values)), 4)
                one[f"{name}_error"] = round(float(np.std(values, ddof=1) / np.sqrt(len(values))), 4)
        one["worst"] = round(min(row["accuracy"] for row in some), 2)
        if "order" in some[0]:
            one["refused"] = sum(row["hardware"] is None for row in some)
            one["bound"] = max(row.get("bound", 0.0) for row in some)
            one["orders"] = sorted(row["order"] for row in some)
            differences = [abs(row["hardware"] - row["accuracy"]) for row in some if row["hardware"] is not None]
            one["off"] = round(max(differences), 4)
        else:
            one["refused"] = sum(row["refused"] for row in some)
        found.append(one)
    return found


def of_services(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the figures of the services in double precision, with those of the axles that the hardware read, too."""
    found = summed([row for row in rows if row["by"] == "double"], ("targets", "way"))
    for one in found:
        alike = [row for row in rows if (row["targets"], row["way"]) == (one["targets"], one["way"])]
        by_hardware = {row["seed"]: row for row in alike if row["by"] == "hardware"}
        both = [
            (row, by_hardware[row["seed"]]) for row in alike if row["by"] == "double" and row["seed"] in by_hardware
        ]
        one["axles"] = len(both)
        one["same"], one["hardware"] = (
            round(float(np.mean([pair[k]["accuracy"] for pair in both])), 4) for k in (0, 1)
        )
        one["inside_hardware"] = round(float(np.mean([own["inside"] for _, own in both])), 4)
        one["off"] = round(max(abs(own["accuracy"] - row["accuracy"]) for row, own in both), 4)
    return found


def main() -> None:
    """Measure; print JSON, or renew the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.days", description=__doc__)
    parser.add_argument("--document", action="store_true", help="record, and renew docs/days.md")
    parser.add_argument("--recorded", action="store_true", help="do not measure: renew the page from the record")
    parser.add_argument("--part", action="append", choices=tuple(FIRST_SEEDS), help="measure this part only")
    parser.add_argument("-o", "--output", type=Path, default=Path("build/days"), help="folder for specifications")
    arguments = parser.parse_args()
    earlier = json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}
    found = earlier
    if not arguments.recorded:
        with show_progress() as step:
            found = measured(arguments.part or list(FIRST_SEEDS), earlier, arguments.output, step)
    text = json.dumps(found, indent=1) + "\n"
    if not (arguments.document or arguments.recorded):
        print(text, end="")
        return
    write_contents(HERE, {RECORD.name: text.encode()})
    write_contents(PAGE.parent, {PAGE.name: page(found).encode()})


if __name__ == "__main__":
    main()
