"""The core file of FuseSoC (CAPI2), with targets for lint, simulation and synthesis."""

from __future__ import annotations

from sosmith.gen.output.packages.facts import PackageFacts
from sosmith.model.templates import render


def fusesoc_files(facts: PackageFacts) -> dict[str, str]:
    """Return the core file by its path in the package."""
    text = render(__package__, "fusesoc.core.jinja", name=facts.name, vlnv=facts.vlnv, description=facts.description)
    return {f"{facts.name}.core": text}
