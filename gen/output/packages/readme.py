"""The README of a package: what the core is, its ports, its timing, and which tool reads which file."""

from __future__ import annotations

from sosmith.gen.output.packages.facts import PackageFacts
from sosmith.gen.version import __version__
from sosmith.model.templates import render


def readme_files(facts: PackageFacts) -> dict[str, str]:
    """Return the README by its path in the package."""
    return {"README.md": render(__package__, "README.md.jinja", facts=facts, name=facts.name, version=__version__)}
