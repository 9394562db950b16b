"""What identifies a run: digests of specification, exact calculation, trace and datapath; the hardware's cost."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sosmith.gen.core import CoreDesign
from sosmith.gen.estimate.estimate import USUAL, estimated
from sosmith.gen.fpga.boards import find_board
from sosmith.gen.fpga.synthesis import Netlist
from sosmith.model.dataflow.c_model import c_source
from sosmith.model.port import Port
from sosmith.model.traces.trace import Trace


@dataclass(frozen=True, kw_only=True)
class Provenance:
    """Digests are SHA-256 in hexadecimal digits; two runs can be compared where they agree.

    Attributes
    ----------
    specification : Mapping
        The specification as read, in the types of JSON.
    specification_sha256 : str
        Of the specification's text.
    reference_sha256 : str
        Of the exact calculation: input formats, polynomial, ideal sections, the output's range and unit, channels.
    trace_sha256 : str
        Of the input codes of all channels, with the inputs' formats and the sample rate.
    datapath_sha256 : str
        Of the datapath, as its C model, whatever its name.
    cycles_per_sample : float
        Largest number of clocks between samples that the hardware needs, without waiting: a whole number but where a
        beat holds several samples, or behind a decimator, where it is the average.
    cost : Mapping
        As `hardware_cost` returns it.
    """

    specification: Mapping[str, Any]
    specification_sha256: str
    reference_sha256: str
    trace_sha256: str
    datapath_sha256: str
    cycles_per_sample: float
    cost: Mapping[str, Any]


def provenance_of(design: CoreDesign, traces: Sequence[Trace], netlist: Netlist | None = None) -> Provenance:
    """Collect the provenance of a run of `design` with `traces`, one for each channel; of `netlist` if that ran."""
    return Provenance(
        specification=design.spec.source,
        specification_sha256=hashlib.sha256(design.spec.text.encode()).hexdigest(),
        reference_sha256=reference_digest(design),
        trace_sha256=trace_digest(traces),
        datapath_sha256=hashlib.sha256(datapath_text(design).encode()).hexdigest(),
        cycles_per_sample=design.architecture.clocks_per_sample,
        cost=hardware_cost(design, netlist),
    )


def datapath_text(design: CoreDesign) -> str:
    """Return the arithmetic of a core as its C model, whatever its name."""
    return c_source(replace(design.datapath, name="datapath"))


def reference_digest(design: CoreDesign) -> str:
    """Digest of the exact calculation that the hardware is held against, without how the hardware is built."""
    return reference_of_stages([(design,)])


def reference_of_stages(stages: Sequence[Sequence[CoreDesign]]) -> str:
    """Return the same digest of stages in series; of one that interpolates there are the cores of all its results.

    It does not tell stages from a single core that computes the same: a calibration, and then one filter.
    """
    first, last = stages[0][0], stages[-1][0]
    polynomial, output = first.quantized.polynomial, last.datapath.output
    filters = [[_filter(core) for core in cores] for cores in stages if cores[0].quantized.filter is not None]
    alone = len(filters) < 2 and all(len(cores) == 1 for cores in filters)
    return _digest(
        {
            "inputs": [_port(port) for port in first.datapath.inputs],
            "polynomial": None if polynomial is None else [[str(a) for a in row] for row in polynomial.coefficients],
            "range": [str(output.zero + output.lsb * code) for code in (output.lowest, output.highest + 1)],
            "unit": output.unit,
            "channels": first.spec.channels,
            **({"sections": []} if not filters else filters[0][0] if alone else {"stages": filters}),
        }
    )


def _filter(design: CoreDesign) -> dict[str, Any]:
    assert design.quantized.filter is not None
    return {"sections": design.quantized.filter.sos.tolist(), **_decimation(design)}


def _decimation(design: CoreDesign) -> dict[str, Any]:
    decimator = design.datapath.decimator
    if design.datapath.downsampler is not None and design.datapath.samples_per_result > 1:
        return {"decimation": [design.datapath.downsampler.factor]}
    return {} if decimator is None else {"decimation": [decimator.factor, decimator.stages]}


def trace_digest(traces: Sequence[Trace]) -> str:
    """Digest of the codes of all channels, with the formats that give them a meaning."""
    first = traces[0]
    head = {"inputs": [_port(port) for port in first.ports], "sample_rate": str(first.sample_rate)}
    whole = hashlib.sha256(_digest(head).encode())
    for trace in traces:
        whole.update(hashlib.sha256(np.ascontiguousarray(trace.codes, dtype="<i8").data).digest())
    return whole.hexdigest()


_OF_COST = (
    *("luts", "multiplier_blocks", "register_bits", "memory_bits", "within"),
    *("instructions", "memory_words", "accumulator_bits"),
)


def hardware_cost(design: CoreDesign, netlist: Netlist | None = None) -> dict[str, Any]:
    """Tell what the hardware takes.

    Returns
    -------
    dict
        ``source``: "synthesis" with the counted cells of `netlist`, or "estimate" before synthesis. ``board``: of the
        netlist, else None. ``device``: the FPGA. ``luts`` (LUT4), ``multiplier_blocks`` and, of an estimate,
        ``register_bits`` (flip-flops), ``memory_bits`` and ``within``, the relative error of ``luts`` that 9 of 10
        designs do not exceed; of a program ``instructions``, ``memory_words`` and ``accumulator_bits``, with those of
        one before a decimator but without the decimator. What is not known is None.
    """
    cost: dict[str, Any] = dict.fromkeys(_OF_COST)
    program, calibration = design.architecture.program, design.architecture.calibration
    programs = [each for each in (program, None if calibration is None else calibration.program) if each is not None]
    if programs:
        cost |= {
            "instructions": sum(len(each.instructions) for each in programs),
            "memory_words": sum(each.words for each in programs),
            "accumulator_bits": sum(each.accumulator_bits for each in programs),
        }
    if netlist is not None:
        return cost | counted(netlist)
    estimate = estimated(design.architecture, find_board(USUAL[0]))
    assert estimate is not None
    cost |= {
        "luts": estimate.luts,
        "multiplier_blocks": estimate.multiplier_blocks,
        "register_bits": estimate.flip_flops,
        "memory_bits": estimate.memory_bits,
        "within": estimate.tested.nine_in_ten,
    }
    return {"source": "estimate", "board": None, "device": estimate.device, **cost}


def counted(netlist: Netlist) -> dict[str, Any]:
    """Return what is known of a cost after synthesis, by the keys of `hardware_cost`; of the rest nothing is."""
    board = netlist.board
    return {
        "source": "synthesis",
        "board": board.name,
        "device": board.device.title,
        "luts": board.device.luts(netlist.cells),
        "multiplier_blocks": netlist.cells.get(board.device.multiplier or "", 0),
        **dict.fromkeys(("register_bits", "memory_bits", "within")),
    }


def _port(port: Port) -> list[Any]:
    return [port.name, port.bits, port.signed, str(port.lsb), str(port.zero), port.unit]


def _digest(tree: Any) -> str:
    return hashlib.sha256(json.dumps(tree, sort_keys=True).encode()).hexdigest()
