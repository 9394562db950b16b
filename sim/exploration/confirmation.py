"""Co-simulates the designs of a front, with a report for each."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.chain.report.report import write_chain_report
from sosmith.gen.core import CoreDesign
from sosmith.gen.report.report import write_report
from sosmith.model.arrays import side_by_side
from sosmith.sim.chain import simulate_chain
from sosmith.sim.exploration.evaluation import designed, traces_of
from sosmith.sim.exploration.run import Outcome
from sosmith.sim.simulation import simulate

Progress = Callable[[str, int, int], None]
Uncertainty = Callable[[CoreDesign], dict[str, Any] | None]


def confirmed(
    outcome: Outcome, folder: Path, *, uncertainty: Uncertainty, simulator: str = "verilator", progress: Progress
) -> Outcome:
    """Co-simulate the front on the traces of the exploration; reports that are there already are kept.

    `uncertainty` returns the budget of a core for its report, as `sosmith.sim.simulation.simulate` takes it.

    Returns
    -------
    Outcome
        The same, with ``report`` and ``report_passed`` in the points of the front.

    Raises
    ------
    ToolError
        If the simulator is missing or fails.
    ShortfallError
        If hardware breaks the stream protocol.
    """
    tasks = {task.key: task for task in outcome.tasks}
    front = outcome.front
    passed: dict[str, bool] = {}
    for done, point in enumerate(front):
        progress("co-simulating the front", done, len(front))
        place = folder / _place(point["key"])
        kept = place / "report.json"
        if kept.exists():
            passed[point["key"]] = bool(json.loads(kept.read_text(encoding="utf-8"))["passed"])
            continue
        task = tasks[point["key"]]
        design = designed(task)
        traces = traces_of(design, task)
        if isinstance(design, ChainDesign):
            codes = side_by_side([trace.codes for trace in traces])
            run = simulate_chain(design, codes, place, simulator=simulator, seed=task.seed)
            passed[point["key"]] = bool(write_chain_report(design, run, traces, place)["passed"])
            continue
        budget = uncertainty(design)
        evidence = simulate(design, traces, place, simulator=simulator, seed=task.seed, uncertainty=budget)
        passed[point["key"]] = bool(write_report(evidence, place)["passed"])
    progress("co-simulating the front", len(front), len(front))
    points = tuple(
        point | {"report": f"{_place(point['key'])}/report.html", "report_passed": passed[point["key"]]}
        if point["key"] in passed
        else point
        for point in outcome.points
    )
    return dataclasses.replace(outcome, points=points)


def _place(key: str) -> str:
    return f"front/{key[:12]}"
