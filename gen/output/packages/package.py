"""Packs a core: its files, and beside them what other tools need to take it in."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from sosmith.gen.core import CoreDesign
from sosmith.gen.output.core_facts import core_facts
from sosmith.gen.output.generate import generated
from sosmith.gen.output.packages.bench import bench_files
from sosmith.gen.output.packages.pins import pins
from sosmith.model.text_files import write_files


def package(design: CoreDesign, directory: Path, progress: Callable[[str], None] = lambda step: None) -> list[Path]:
    """Write the package of a core into `directory`; return the paths of the files.

    Two runs on the same specification write the same bytes.

    Parameters
    ----------
    design : CoreDesign
        The core.
    directory : Path
        Folder of the package, made if missing.
    progress : callable
        Called with the name of each step.

    Raises
    ------
    ToolError
        If Yosys fails, or the disk is full.
    SpecificationError
        If the folder cannot be written.
    """
    folders: dict[Path, dict[str, str]] = {}
    for path, text in packed(design, progress).items():
        place = directory / path
        folders.setdefault(place.parent, {})[place.name] = text
    return [path for folder, texts in folders.items() for path in write_files(folder, texts)]


def packed(design: CoreDesign, progress: Callable[[str], None] = lambda step: None) -> dict[str, str]:
    """Return the texts that `package` writes, by their paths in the package; parameters and errors as there."""
    facts = core_facts(design)
    core = generated(design, progress, facts=facts)
    progress("bench")
    ports = pins(design, facts.interface)
    return {
        **{f"core/{name}": text for name, text in core.items()},
        **bench_files(design, facts, ports),
    }
