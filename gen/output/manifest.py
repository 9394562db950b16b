"""The manifest: everything about a generated core that a program around it needs to know."""

from __future__ import annotations

from typing import Any

import sosmith
from sosmith.gen.core import CoreDesign
from sosmith.gen.proof.limit_cycles import limit_cycles, recursions
from sosmith.gen.proof.linear_model import linear_model
from sosmith.gen.reload.register_writes import bank_size
from sosmith.gen.word_lengths.cost import cost_of
from sosmith.hdl.axi_stream import dest_width, fields, width
from sosmith.model.dataflow.datapath import Datapath, Stage
from sosmith.model.dataflow.graph import Graph, Op
from sosmith.model.dataflow.program import Program
from sosmith.model.dataflow.status import STATUS_BITS, Flag
from sosmith.model.port import Port
from sosmith.model.reload.registers import INTERFACE
from sosmith.model.sections.direct_form import DirectForm1
from sosmith.model.sections.horner import HornerStep


def manifest(design: CoreDesign) -> dict[str, Any]:
    """Return the manifest as a tree of JSON values; lengths in bits, errors in the output's unit."""
    quantized, datapath, channels = design.quantized, design.datapath, design.spec.channels
    output = datapath.output
    return {
        "name": datapath.name,
        "core": design.core,
        "sosmith_version": sosmith.__version__,
        "spec": design.spec.source,
        "channels": channels,
        "streams": {
            "s_axis": _stream(datapath.inputs, channels),
            "m_axis": _stream((datapath.output,), channels)
            | {"tuser": {"width": STATUS_BITS, "flags": {flag.name.lower(): flag.value for flag in Flag}}},
        },
        "wear": _wear(design),
        "reset_cycles": design.architecture.reset_cycles,
        "latency_cycles": design.architecture.latency_cycles,
        "cycles_per_sample": design.architecture.cycles_per_sample,
        "realization": quantized.realization if quantized.sections else None,
        "architecture": design.architecture.name,
        "schedule": _schedule(design.architecture.program),
        "reload": _reload(design),
        "reasons": design.reasons,
        "sections": [entry for section in quantized.sections for entry in section_entries(section)],
        "formats": [row for stage in datapath.stages for row in _formats(stage, datapath)],
        "error_bound": float(quantized.bound * output.lsb),
        "error_bound_proven": True,
        "error_parts": {part: float(value * output.lsb) for part, value in quantized.budget.items()},
        "error_unit": datapath.output.unit,
        "limit_cycles": [
            _limit_cycles(name, graph, output)
            for section in quantized.sections
            for name, graph in recursions(section).items()
        ],
        "aliasing": _aliasing(design),
        "cost": _cost(design),
    }


def _wear(design: CoreDesign) -> list[dict[str, Any]] | None:
    """Clearances in the output's unit at which the flags of wear rise, and the codes, for all channels or for each."""
    if design.spec.wear is None:
        return None
    clearances = design.spec.wear.clearances()[: len(design.datapath.wear)]
    return [
        {"warning": float(warning), "critical": float(critical), "codes": list(codes)}
        for (warning, critical), codes in zip(clearances, design.datapath.wear, strict=True)
    ]


def section_entries(section: Stage) -> list[dict[str, Any]]:
    """Integer coefficients of a section, and the transfer function they make exactly: one entry for each recursion."""
    entries = [_section_entry(name, graph) for name, graph in recursions(section).items()]
    if isinstance(section, DirectForm1):
        for entry in entries:
            entry["error_feedback"] = list(section.feedback)
    return entries


def _section_entry(name: str, graph: Graph) -> dict[str, Any]:
    nodes = graph.nodes
    model = linear_model(graph)
    b, a = ([*map(float, values), 0.0, 0.0][:3] for values in (model.transfer, model.denominator))
    return {
        "name": name,
        "coefficients": [
            {
                "name": node.name.removeprefix("product_"),
                "integer": node.parameter,
                "frac": node.parameter_frac,
                "value": node.parameter / 2**node.parameter_frac,
            }
            for node in nodes
            if node.op is Op.SCALE
        ],
        "states": {nodes[i].name: nodes[i].format for i in graph.delays},
        "b": b,
        "a": a,
        "input": nodes[graph.inputs[0]].format,
        "output": nodes[graph.outputs[0]].format,
    }


def _limit_cycles(name: str, graph: Graph, output: Port) -> dict[str, Any]:
    """Tell what a section's quantizers can sustain at its own output, in the output's unit."""
    found = limit_cycles(graph)
    return {
        "section": name,
        "largest": float(found.largest * output.lsb),
        "dead_band": float(found.dead_band * output.lsb),
        "none": found.none,
        "lyapunov": None if found.lyapunov is None else [str(weight) for weight in found.lyapunov],
    }


def _schedule(program: Program | None) -> dict[str, Any] | None:
    """Program of the folded and serial architectures; each instruction as opcode, address and constant."""
    if program is None:
        return None
    return {
        "digit_bits": program.digit_bits,
        "accumulator_bits": program.accumulator_bits,
        "states": program.states,
        "words": program.words,
        "places": [
            {"name": p.name, "address": p.address, "digits": p.digits, "frac": p.frac, "state": p.is_state}
            for p in sorted(program.locations, key=lambda location: location.address)
        ],
        "instructions": [[opcode.mnemonic, address, constant] for opcode, address, constant in program.instructions],
    }


def _reload(design: CoreDesign) -> dict[str, Any] | None:
    """Tell what a set for this core has to fit, and which files describe its registers."""
    if design.architecture.fingerprint is None:
        return None
    words, bits = bank_size(design.architecture)
    return {
        "interface": INTERFACE,
        "design": design.architecture.fingerprint,
        "words": words,
        "word_bits": bits,
        "registers": [f"{design.spec.name}_registers.h", f"{design.spec.name}.rdl"],
    }


def _aliasing(design: CoreDesign) -> dict[str, float] | None:
    ideal = design.quantized.filter
    if ideal is None or ideal.aliasing is None:
        return None
    return {"max_deviation": ideal.aliasing.max_deviation, "dc_error": ideal.aliasing.dc_error}


def _stream(ports: tuple[Port, ...], channels: int) -> dict[str, Any]:
    dest = {"tdest": {"width": dest_width(channels)}} if channels > 1 else {}
    return dest | {
        "width": width(ports),
        "fields": [
            {
                "name": field.port.name,
                "offset": field.offset,
                "width": field.port.bits,
                "signed": field.port.signed,
                "lsb": float(field.port.lsb),
                "zero": float(field.port.zero),
                "unit": field.port.unit,
            }
            for field in fields(ports)
        ],
    }


def _formats(stage: Stage, datapath: Datapath) -> list[dict[str, Any]]:
    """Name, Q format and physical range of every named node of a stage.

    Values inside are output LSBs, except the polynomial's variables, which are fractions of their range.
    """
    variables = {port.name for port in datapath.inputs}
    rows = []
    for node in stage.graph.nodes:
        if node.name:
            plain = isinstance(stage, HornerStep) and node.name in variables
            scale = (1.0 if plain else float(datapath.output.lsb)) * 2.0**-node.frac
            unit = "" if plain else datapath.output.unit
            row = {"stage": stage.name, "node": node.name, "format": node.format}
            rows.append(row | {"low": node.low * scale, "high": node.high * scale, "unit": unit})
    return rows


def _cost(design: CoreDesign) -> dict[str, Any]:
    cost = cost_of(design.datapath)
    return {
        "multipliers": [list(size) for size in cost.multipliers],
        "adder_bits": cost.adder_bits,
        "register_bits": cost.register_bits,
    }
