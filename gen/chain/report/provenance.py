"""What identifies a run of a chain, and what the cores of its stages take together, as of a single core."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Any

from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.core import CoreDesign
from sosmith.gen.fpga.synthesis import Netlist
from sosmith.gen.report.provenance import (
    Provenance,
    counted,
    datapath_text,
    hardware_cost,
    reference_of_stages,
    trace_digest,
)
from sosmith.model.traces.trace import Trace

_SAME = ("source", "board", "device")
"""What is the same of all cores."""


def chain_provenance(design: ChainDesign, traces: Sequence[Trace]) -> Provenance:
    """Collect the provenance of a run with `traces`, one for each channel."""
    cores = _cores(design)
    return Provenance(
        specification=design.spec.source,
        specification_sha256=hashlib.sha256(design.spec.text.encode()).hexdigest(),
        reference_sha256=reference_of_stages([stage.cores for stage in design.stages]),
        trace_sha256=trace_digest(traces),
        datapath_sha256=hashlib.sha256("".join(map(datapath_text, cores)).encode()).hexdigest(),
        cycles_per_sample=design.clocks_per_sample,
        cost=chain_cost(design),
    )


def chain_cost(design: ChainDesign, netlist: Netlist | None = None) -> dict[str, Any]:
    """Tell what a chain takes, as `hardware_cost` does of a core.

    An estimate is that of the cores; of what joins them, flags and turns, nothing is counted before synthesis.
    """
    costs = [hardware_cost(core) for core in _cores(design)]
    total: dict[str, Any] = {key: _sum([cost[key] for cost in costs]) for key in costs[0] if key not in _SAME}
    total |= {key: costs[0][key] for key in _SAME} | {"within": max(cost["within"] for cost in costs)}
    return total if netlist is None else total | counted(netlist)


def names_of(design: ChainDesign) -> tuple[str, str]:
    """Name the realizations and the architectures of the stages, each once, in the order of the samples."""
    cores = _cores(design)
    realizations = [core.quantized.realization for core in cores if core.quantized.sections]
    architectures = [core.architecture.name for core in cores]
    return ", ".join(dict.fromkeys(realizations)) or "none", ", ".join(dict.fromkeys(architectures))


def _cores(design: ChainDesign) -> list[CoreDesign]:
    return [core for stage in design.stages for core in stage.cores]


def _sum(values: Sequence[Any]) -> Any:
    """Add what is known; None if nothing is."""
    known = [value for value in values if value is not None]
    return sum(known) if known else None
