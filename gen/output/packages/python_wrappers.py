"""The core for Python's hardware libraries: Amaranth component, LiteX module, and driver for cocotb."""

from __future__ import annotations

from sosmith.gen.output.packages.facts import PackageFacts, fields_of_beat
from sosmith.model.templates import render


def wrapper_files(facts: PackageFacts) -> dict[str, str]:
    """Return the three modules by their paths in the package; none of them imports sosmith."""
    (result,) = facts.interface.outputs.fields
    results, lanes = fields_of_beat(facts.interface.outputs), facts.interface.inputs.lanes
    values = {
        "name": facts.name,
        "Name": "".join(part.capitalize() for part in facts.name.split("_")) or "Core",
        "inputs": facts.interface.inputs.fields,
        "result": result,
        "lanes": lanes,
        "inputs_of_beat": fields_of_beat(facts.interface.inputs),
        "results_of_beat": results,
        "registers_out": [("result" if lanes == 1 else f"result_{k}", field) for k, field in enumerate(results)],
        "sample": "sample" if lanes == 1 else "beat",
        "beats": "results" if lanes == 1 else "beats",
        "decimation": facts.core.lower_rate,
        "dest": facts.interface.inputs.dest_width,
        "width_in": facts.interface.inputs.width,
        "width_out": facts.interface.outputs.width,
        "sample_in": facts.interface.inputs.sample_width,
        "sample_out": facts.interface.outputs.sample_width,
        "user": facts.interface.outputs.user_width,
        "flags": facts.interface.outputs.flags,
        "pins": facts.pins,
        "registers": facts.registers,
        "channels": facts.core.channels,
        "unit": facts.core.unit,
    }
    return {
        f"python/{facts.name}_{library}.py": render(__package__, f"{library}.py.jinja", **values)
        for library in ("amaranth", "litex", "cocotb")
    }
