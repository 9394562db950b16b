"""Makes and measures one design of an exploration: proof, bit-true run, cost. Runs in worker processes."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.filter.response import measure_response
from sosmith.gen.fpga.boards import find_board
from sosmith.gen.quantity import quantity
from sosmith.gen.report.comparison.choice import cost_unit, hardware_cost
from sosmith.gen.report.mask import mask_shortfalls
from sosmith.gen.report.provenance import provenance_of
from sosmith.gen.report.run import run_of
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.reference.accuracy import error_statistics, sqnr_db
from sosmith.model.traces.trace import Trace
from sosmith.sim.exploration.grid import Task
from sosmith.sim.exploration.synthesis import synthesized

Point = dict[str, Any]
"""What `evaluate` returns, in the types of JSON."""


def evaluate(task: Task) -> Point:
    """Design, prove and run one combination.

    Returns
    -------
    dict
        ``key`` and ``changes`` of the task; ``refused``: why there is no such design, else None. Of a design:
        ``passed``, ``shortfalls``, ``realization``, ``architecture``, ``error.{bound,max_abs,rms,unit}`` (the first
        proven for all inputs in range, the others measured on the integer model), ``sqnr_db``,
        ``stopband_attenuation_db``, ``cycles_per_sample``, ``samples_per_clock``, ``latency_cycles``, ``cost`` (see
        `sosmith.gen.report.provenance.hardware_cost`) and ``cost.{value,unit}``, its one figure,
        ``reference_sha256``, ``trace_sha256``, ``datapath_sha256``. The same for the same task, on every machine.

    Raises
    ------
    ToolError
        If the C compiler or Yosys is missing or fails.
    """
    head: Point = {"key": task.key, "changes": task.changes}
    try:
        design = design_core(task.specification(), core=task.core)
        traces = traces_of(design, task)
    except (SpecificationError, ShortfallError) as error:
        return head | {"refused": str(error).removeprefix(f"{task.path}: ")}  # wherever the specification lies
    return head | {"refused": None} | _measured(design, traces, task)


def traces_of(design: CoreDesign, task: Task) -> tuple[Trace, ...]:
    """Make the traces that a design of `task` is run on."""
    seconds = task.samples / float(design.spec.sample_rate)
    return task.traces(design, task.seed, seconds)


def _measured(design: CoreDesign, traces: tuple[Trace, ...], task: Task) -> Point:
    quantized, output = design.quantized, design.datapath.output
    run = run_of(design, traces)
    statistics = error_statistics(run.error)
    bound, allowed = float(quantized.bound * output.lsb), float(design.spec.max_error)
    shortfalls = [
        f"The largest error is {quantity(statistics.max_abs, output.unit)}, more than the "
        f"{quantity(limit, output.unit)} {words}."
        for limit, words in ((bound, "proven"), (allowed, "allowed"))
        if statistics.max_abs > limit
    ]
    facts = quantized.filter_facts
    response = None if facts is None else measure_response(facts)
    if facts is not None and response is not None:
        shortfalls += mask_shortfalls(facts, response)
    provenance = provenance_of(design, traces)
    if task.board is not None:
        cost = synthesized(design, find_board(task.board))
        provenance = dataclasses.replace(provenance, cost=cost)
    priced = {"provenance": {"cost": provenance.cost}}
    return {
        "passed": not shortfalls,
        "shortfalls": shortfalls,
        "realization": quantized.realization if quantized.sections else "none",
        "architecture": design.architecture.name,
        "error": {"bound": bound, "max_abs": statistics.max_abs, "rms": statistics.rms, "unit": output.unit},
        "sqnr_db": _finite(sqnr_db(run.golden, run.error)),
        "stopband_attenuation_db": None if response is None else _finite(response.stopband_attenuation_db),
        "cycles_per_sample": provenance.cycles_per_sample,
        "samples_per_clock": design.architecture.samples_per_clock,
        "latency_cycles": design.architecture.latency_cycles,
        "cost": {"value": hardware_cost(priced), "unit": cost_unit(priced), **provenance.cost},
        "reference_sha256": provenance.reference_sha256,
        "trace_sha256": provenance.trace_sha256,
        "datapath_sha256": provenance.datapath_sha256,
    }


def _finite(value: float | None) -> float | None:
    return None if value is None or not np.isfinite(value) else float(value)
