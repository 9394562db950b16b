"""The manifest: the facts about a generated core as a tree of JSON values, for other programs."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from sosmith.gen.output.core_facts import CoreFacts, LimitCycleFacts, SectionFacts, StreamFacts
from sosmith.gen.output.decimation_facts import DecimationFacts, DownsamplingFacts
from sosmith.gen.version import __version__
from sosmith.model.dataflow.program import Program


def manifest(facts: CoreFacts) -> dict[str, Any]:
    """Return the manifest as a tree of JSON values; lengths in bits, errors in the output's unit."""
    interface = facts.interface
    return {
        "name": facts.name,
        "core": facts.core,
        "sosmith_version": __version__,
        "spec": facts.spec,
        "channels": facts.channels,
        "streams": {"s_axis": stream_entry(interface.inputs), "m_axis": stream_entry(interface.outputs)},
        "wear": None if facts.wear is None else [_entry(limits) for limits in facts.wear],
        "reset_cycles": interface.reset_cycles,
        "latency_cycles": interface.latency_cycles,
        "cycles_per_sample": facts.cycles_per_sample,
        "realization": facts.realization,
        **({"pipeline": "look-ahead"} if facts.look_ahead else {}),
        "start": facts.start,
        "settling": None if facts.settling is None else _entry(facts.settling),
        "architecture": facts.architecture,
        "schedule": _schedule(facts.program),
        "reload": None if facts.reload is None else _entry(facts.reload),
        "protect": facts.protect,
        "sections": [_section(section) for section in facts.sections],
        "formats": [_entry(row) for row in facts.formats],
        "error_bound": facts.error_bound,
        "error_bound_proven": True,
        "error_parts": dict(facts.error_parts),
        "error_unit": facts.unit,
        "limit_cycles": [limit_cycle_entry(cycles) for cycles in facts.limit_cycles],
        "aliasing": None if facts.aliasing is None else _entry(facts.aliasing),
        "decimation": None if facts.lower_rate is None else _decimation(facts.lower_rate),
        "cost": {
            "multipliers": [list(size) for size in facts.cost.multipliers],
            "adder_bits": facts.cost.adder_bits,
            "register_bits": facts.cost.register_bits,
        },
    }


def limit_cycle_entry(cycles: LimitCycleFacts) -> dict[str, Any]:
    """Return the facts about a section's limit cycles as JSON values; the weights are rationals as strings."""
    weights = None if cycles.lyapunov is None else [str(weight) for weight in cycles.lyapunov]
    return _entry(cycles) | {"lyapunov": weights}


def _decimation(facts: DecimationFacts | DownsamplingFacts) -> dict[str, Any]:
    return {name: list(value) if isinstance(value, tuple) else value for name, value in facts.entries.items()}


def _entry(facts: Any) -> dict[str, Any]:
    """Attributes of a dataclass as JSON values, in their order."""
    return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(facts).items()}


def stream_entry(stream: StreamFacts) -> dict[str, Any]:
    """Return a stream as JSON values."""
    dest = {"tdest": {"width": stream.dest_width}} if stream.dest_width else {}
    user = {"tuser": {"width": stream.user_width, "flags": dict(stream.flags)}} if stream.flags else {}
    several = {"samples": stream.lanes, "sample_width": stream.sample_width} if stream.lanes > 1 else {}
    return (
        dest
        | {
            "width": stream.width,
            **several,
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
                for field in stream.fields
            ],
        }
        | user
    )


def _section(section: SectionFacts) -> dict[str, Any]:
    entry = _entry(section)
    if section.error_feedback is None:
        del entry["error_feedback"]
    return entry


def _schedule(program: Program | None) -> dict[str, Any] | None:
    """Program of the folded and serial architectures; each instruction as opcode, address, constant and target.

    Where there are two products a clock, the second address and the second constant follow.
    """
    if program is None:
        return None
    return {
        "digit_bits": program.digit_bits,
        "accumulator_bits": program.accumulator_bits,
        "states": program.states,
        "words": program.words,
        "places": [
            {"name": p.name, "addresses": list(p.addresses), "frac": p.frac, "state": p.is_state}
            for p in program.locations
        ],
        "instructions": [
            [opcode.mnemonic, *fields[: 1 + 2 * program.products]] for opcode, *fields in program.instructions
        ],
    }
