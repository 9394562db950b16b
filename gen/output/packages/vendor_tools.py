"""Scripts for Vivado and Quartus: synthesis out of context, with the clock of the specification as constraint."""

from __future__ import annotations

from collections.abc import Sequence

from sosmith.gen.output.packages.facts import PackageFacts
from sosmith.model.templates import render


def vendor_files(facts: PackageFacts) -> dict[str, str]:
    """Return scripts and constraints by their paths in the package."""
    return scripts([facts.name], facts.period, [pin.name for pin in facts.pins])


def scripts(modules: Sequence[str], period: float, pins: Sequence[str]) -> dict[str, str]:
    """Return those for modules of a file each, the last of which is the top with these pins; `period` is in ns."""
    name = modules[-1]
    values = {"name": name, "modules": modules, "period": f"{period:.3f}", "pins": pins}
    paths = {
        "vivado/synthesize.tcl": "vivado.tcl.jinja",
        f"vivado/{name}.xdc": "clock.sdc.jinja",
        "quartus/synthesize.tcl": "quartus.tcl.jinja",
        f"quartus/{name}.sdc": "clock.sdc.jinja",
    }
    return {path: render(__package__, template, **values) for path, template in paths.items()}
