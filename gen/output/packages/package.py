"""Packs a core: its files, and beside them what other tools need to take it in."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from sosmith.gen.core import CoreDesign
from sosmith.gen.output.generate import generated
from sosmith.gen.output.packages.bench import bench_files
from sosmith.gen.output.packages.driver import driver_files
from sosmith.gen.output.packages.facts import package_facts
from sosmith.gen.output.packages.fusesoc import fusesoc_files
from sosmith.gen.output.packages.ip_xact import ip_xact_files
from sosmith.gen.output.packages.librelane import librelane_files
from sosmith.gen.output.packages.python_wrappers import wrapper_files
from sosmith.gen.output.packages.readme import readme_files
from sosmith.gen.output.packages.timing_diagram import timing_files
from sosmith.gen.output.packages.vendor_tools import vendor_files
from sosmith.gen.output.packages.vhdl import vhdl_files
from sosmith.gen.output.packages.vlnv import Vlnv
from sosmith.model.errors import SpecificationError
from sosmith.model.text_files import write_files


def package(
    design: CoreDesign,
    directory: Path,
    progress: Callable[[str], None] = lambda step: None,
    *,
    vlnv: Vlnv | None = None,
) -> list[Path]:
    """Write the package of a core into `directory`; return the paths of the files.

    Two runs on the same specification write the same bytes.

    Parameters
    ----------
    design : CoreDesign
        The core.
    directory : Path
        Folder of the package, created if missing.
    progress : callable
        Called with the name of each step.
    vlnv : Vlnv or None
        Name of the package for FuseSoC and IP-XACT; None for `Vlnv.default`.

    Raises
    ------
    ToolError
        If Yosys fails, or the disk is full.
    SpecificationError
        If the folder cannot be written.
    """
    folders: dict[Path, dict[str, str]] = {}
    for path, text in packed(design, progress, vlnv=vlnv).items():
        place = directory / path
        folders.setdefault(place.parent, {})[place.name] = text
    return [path for folder, texts in folders.items() for path in write_files(folder, texts)]


def packed(
    design: CoreDesign, progress: Callable[[str], None] = lambda step: None, *, vlnv: Vlnv | None = None
) -> dict[str, str]:
    """Return the texts that `package` writes, by their paths in the package; parameters and errors as there."""
    path, channels = design.spec.path, design.spec.channels
    if design.datapath.samples_per_result > 1 and channels > 1:
        raise SpecificationError(
            f"{path}: not yet available: channels must be 1 with filter.decimate in a package, not {channels}"
        )
    if design.architecture.bank_pins is not None:
        raise SpecificationError(
            f"{path}: hardware.reload_registers must be true in a package, not false: the registers of such a core are "
            "in the package of its chain"
        )
    if not design.architecture.has_module:
        raise SpecificationError(
            f"{path}: a result that shares its hardware with others must be packed with its chain, not by itself"
        )
    facts = package_facts(design, vlnv)
    core = generated(design, progress, facts=facts.core)
    progress("bench")
    bench = bench_files(design, facts)
    progress("files of other tools")
    return {
        **readme_files(facts),
        **fusesoc_files(facts),
        **{f"core/{name}": text for name, text in core.items()},
        **bench,
        **ip_xact_files(facts),
        **vendor_files(facts),
        **librelane_files(facts),
        **vhdl_files(facts),
        **wrapper_files(facts),
        **driver_files(facts),
        **timing_files(facts),
    }
