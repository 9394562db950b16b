"""The files of hardware that computes all results of a stage with one multiplier."""

from __future__ import annotations

from sosmith.gen.chain.design import StageDesign
from sosmith.gen.output.verilog import texts_of
from sosmith.gen.version import __version__


def shared_hardware(stage: StageDesign) -> dict[str, str]:
    """Return SystemVerilog and RTLIL of what the results of a stage share, by the names of the files; nothing without.

    Raises
    ------
    ToolError
        If Yosys fails.
    """
    if stage.shared is None:
        return {}
    (name,) = stage.modules
    verilog, rtlil = texts_of(stage.shared.whole(), name)
    return {f"{name}.sv": _header(stage, name) + verilog, f"{name}.il": rtlil}


def _header(stage: StageDesign, name: str) -> str:
    of_all = ", ".join(core.datapath.name for core in stage.cores)
    rows = [
        f"{name}: {len(stage.cores)} results of each sample, by one multiplier",
        "",
        "SPDX-License-Identifier: Apache-2.0",
        f"Made by sosmith {__version__}",
        "",
        f"The results are those of {of_all},",
        "in turn, whose certificates have their proofs.",
        f"A sample takes {stage.design.architecture.cycles_per_sample:,} clocks.",
    ]
    return "".join(f"// {row}".rstrip() + "\n" for row in rows) + "\n"
