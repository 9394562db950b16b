"""The driver in C of the registers of a reloadable core."""

from __future__ import annotations

from sosmith.gen.output.packages.facts import PackageFacts
from sosmith.model.templates import render


def driver_files(facts: PackageFacts) -> dict[str, str]:
    """Return source and header by their paths in the package; none for a core without registers."""
    if not facts.registers:
        return {}
    values = {
        "name": facts.name,
        "prefix": facts.name.upper(),
        "protected": any(register.name == "FAULTS" for register in facts.registers),
    }
    return {
        f"driver/{facts.name}_driver.{suffix}": render(__package__, f"driver.{suffix}.jinja", **values)
        for suffix in ("c", "h")
    }
