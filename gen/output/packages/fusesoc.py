"""The core file of FuseSoC (CAPI2), with targets for lint, simulation and synthesis."""

from __future__ import annotations

from collections.abc import Sequence

from sosmith.gen.output.packages.facts import PackageFacts
from sosmith.gen.output.packages.vlnv import Vlnv
from sosmith.model.templates import render


def fusesoc_files(facts: PackageFacts) -> dict[str, str]:
    """Return the core file by its path in the package."""
    return {f"{facts.name}.core": core_file([facts.name], facts.vlnv, facts.description)}


def core_file(modules: Sequence[str], vlnv: Vlnv, description: str) -> str:
    """Return the text of a core file for these modules, of a file each, the last of which is the top."""
    values = {"name": modules[-1], "modules": modules, "vlnv": vlnv, "description": description}
    return render(__package__, "fusesoc.core.jinja", **values)
