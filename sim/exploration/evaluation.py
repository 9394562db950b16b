"""Makes and measures one design of an exploration: proof, bit-true run, cost. Runs in worker processes."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from sosmith.gen.chain.automatic.choice import choose_stages
from sosmith.gen.chain.design import ChainDesign, design_chain
from sosmith.gen.chain.report.measures import response_entry
from sosmith.gen.chain.report.provenance import chain_provenance, names_of
from sosmith.gen.chain.report.run import run_of as run_of_chain
from sosmith.gen.chain.specification import ChainSpec
from sosmith.gen.chain.top import chain_interface
from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.filter.response import measure_response
from sosmith.gen.fpga.boards import find_board
from sosmith.gen.quantity import quantity
from sosmith.gen.report.comparison.choice import cost_unit, hardware_cost
from sosmith.gen.report.mask import mask_shortfalls
from sosmith.gen.report.provenance import Provenance, provenance_of
from sosmith.gen.report.run import run_of
from sosmith.model.arrays import Values, side_by_side
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.port import Port
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
        design = designed(task)
        traces = traces_of(design, task)
    except (SpecificationError, ShortfallError) as error:
        return head | {"refused": str(error).removeprefix(f"{task.path}: ")}  # wherever the specification lies
    return head | {"refused": None} | _measured(design, traces, task)


def designed(task: Task) -> CoreDesign | ChainDesign:
    """Make the core or the chain of a task.

    Raises
    ------
    SpecificationError, ShortfallError
        If there is none.
    """
    spec = task.specification()
    if isinstance(spec, ChainSpec):
        return choose_stages(spec).design if spec.is_automatic else design_chain(spec)
    return design_core(spec, core=task.core)


def traces_of(design: CoreDesign | ChainDesign, task: Task) -> tuple[Trace, ...]:
    """Make the traces that a design of `task` is run on."""
    first = design.stages[0].design if isinstance(design, ChainDesign) else design
    seconds = task.samples / float(first.spec.sample_rate)
    return task.traces(first, task.seed, seconds)


@dataclass(frozen=True, kw_only=True)
class _Seen:
    """What a point says in the same words of a core and of a chain."""

    output: Port
    bound: Fraction
    allowed: Fraction
    golden: Values
    error: Values
    shortfalls: list[str]
    attenuation: float | None
    realization: str
    architecture: str
    samples_per_clock: int
    latency_cycles: int
    provenance: Provenance


def _core_seen(design: CoreDesign, traces: tuple[Trace, ...]) -> _Seen:
    quantized, output, run = design.quantized, design.datapath.output, run_of(design, traces)
    facts = quantized.filter_facts
    response = None if facts is None else measure_response(facts)
    return _Seen(
        output=output,
        bound=quantized.bound * output.lsb,
        allowed=design.spec.max_error,
        golden=run.golden,
        error=run.error,
        shortfalls=[] if facts is None or response is None else mask_shortfalls(facts, response),
        attenuation=None if response is None else response.stopband_attenuation_db,
        realization=quantized.realization if quantized.sections else "none",
        architecture=design.architecture.name,
        samples_per_clock=design.architecture.samples_per_clock,
        latency_cycles=design.architecture.latency_cycles,
        provenance=provenance_of(design, traces),
    )


def _chain_seen(design: ChainDesign, traces: tuple[Trace, ...]) -> _Seen:
    run, output = run_of_chain(design, side_by_side([trace.codes for trace in traces])), design.spec.base.output
    realization, architecture = names_of(design)
    return _Seen(
        output=output,
        bound=design.bound,
        allowed=design.spec.base.max_error,
        golden=run.golden,
        error=output.decode(run.received) - run.golden,
        shortfalls=[],
        attenuation=response_entry(design)["stopband_attenuation_db"],
        realization=realization,
        architecture=architecture,
        samples_per_clock=1,
        latency_cycles=chain_interface(design).latency_cycles,
        provenance=chain_provenance(design, traces),
    )


def _measured(design: CoreDesign | ChainDesign, traces: tuple[Trace, ...], task: Task) -> Point:
    seen = _chain_seen(design, traces) if isinstance(design, ChainDesign) else _core_seen(design, traces)
    statistics, unit, bound = error_statistics(seen.error), seen.output.unit, float(seen.bound)
    shortfalls = [
        f"The largest error is {quantity(statistics.max_abs, unit)}, more than the {quantity(limit, unit)} {words}."
        for limit, words in ((bound, "proven"), (float(seen.allowed), "allowed"))
        if statistics.max_abs > limit
    ] + seen.shortfalls
    provenance = seen.provenance
    if task.board is not None:
        cost = synthesized(design, find_board(task.board))
        provenance = dataclasses.replace(provenance, cost=cost)
    priced = {"provenance": {"cost": provenance.cost}}
    return {
        "passed": not shortfalls,
        "shortfalls": shortfalls,
        "realization": seen.realization,
        "architecture": seen.architecture,
        "error": {"bound": bound, "max_abs": statistics.max_abs, "rms": statistics.rms, "unit": unit},
        "sqnr_db": _finite(sqnr_db(seen.golden, seen.error)),
        "stopband_attenuation_db": _finite(seen.attenuation),
        "cycles_per_sample": provenance.cycles_per_sample,
        "samples_per_clock": seen.samples_per_clock,
        "latency_cycles": seen.latency_cycles,
        "cost": {"value": hardware_cost(priced), "unit": cost_unit(priced), **provenance.cost},
        "reference_sha256": provenance.reference_sha256,
        "trace_sha256": provenance.trace_sha256,
        "datapath_sha256": provenance.datapath_sha256,
    }


def _finite(value: float | None) -> float | None:
    return None if value is None or not np.isfinite(value) else float(value)
