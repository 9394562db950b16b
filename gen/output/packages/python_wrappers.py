"""The core for Python's hardware libraries: Amaranth component, LiteX module, and driver for cocotb."""

from __future__ import annotations

from sosmith.gen.output.packages.facts import PackageFacts
from sosmith.model.templates import render


def wrapper_files(facts: PackageFacts) -> dict[str, str]:
    """Return the three modules by their paths in the package; none of them imports sosmith."""
    (result,) = facts.interface.outputs.fields
    values = {
        "name": facts.name,
        "Name": "".join(part.capitalize() for part in facts.name.split("_")) or "Core",
        "inputs": facts.interface.inputs.fields,
        "result": result,
        "dest": facts.interface.inputs.dest_width,
        "width_in": facts.interface.inputs.width,
        "width_out": facts.interface.outputs.width,
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
