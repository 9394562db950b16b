"""Scripts for Vivado and Quartus: synthesis out of context, with the clock of the specification as constraint."""

from __future__ import annotations

from sosmith.gen.output.packages.facts import PackageFacts
from sosmith.model.templates import render


def vendor_files(facts: PackageFacts) -> dict[str, str]:
    """Return scripts and constraints by their paths in the package."""
    values = {"name": facts.name, "period": f"{facts.period:.3f}", "pins": facts.pins}
    paths = {
        "vivado/synthesize.tcl": "vivado.tcl.jinja",
        f"vivado/{facts.name}.xdc": "clock.sdc.jinja",
        "quartus/synthesize.tcl": "quartus.tcl.jinja",
        f"quartus/{facts.name}.sdc": "clock.sdc.jinja",
    }
    return {path: render(__package__, template, **values) for path, template in paths.items()}
