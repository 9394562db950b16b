r"""Of each sum that synthesis must leave as it is, one bit is kept: the top one, which nothing reads.

::

    (* keep = 32'd1 *)                     wire [34:0] total;
    wire [34:0] total;                     (* keep = 32'd1 *)
    assign total = a + 34'h3ac080000;      wire total_top;
                                           assign total = a + 34'h3ac080000;
                                           assign total_top = total[34];

Yosys merges sums that are added up, unless something else reads them. Of a sum that is kept as a whole, low bits may
be those of an operand under a second name. `abc9` of Yosys 0.70 then leaves without a driver what reads the operand,
and the netlist computes something else. The top bit is a result of the adder.
"""

from __future__ import annotations

import re

_MODULE = re.compile(r"^module .*?^endmodule$", re.MULTILINE | re.DOTALL)
_KEPT = re.compile(
    r"^  \(\* keep = 32'd1 \*\)\n(?P<wire>  wire (?:signed )?\[(?P<top>\d+):0\] (?P<name>\w+);\n)", re.MULTILINE
)
_RTLIL_MODULE = re.compile(r"^module \\.*?^end$", re.MULTILINE | re.DOTALL)
_RTLIL_KEPT = re.compile(
    r"^  attribute \\keep 1\n(?P<wire>  wire width (?P<width>\d{2,}|[2-9]) (?:signed )?\\(?P<name>\S+)\n)", re.MULTILINE
)


def with_kept_bits(verilog: str) -> str:
    """Keep a bit of each wire in a SystemVerilog text that is kept as a whole."""
    return _MODULE.sub(lambda module: _in_verilog(module[0]), verilog)


def rtlil_with_kept_bits(text: str) -> str:
    """Do the same in an RTLIL text."""
    return _RTLIL_MODULE.sub(lambda module: _in_rtlil(module[0]), text)


def _in_verilog(module: str) -> str:
    kept = [(found["name"], found["top"]) for found in _KEPT.finditer(module)]
    module = _KEPT.sub(lambda found: f"{found['wire']}  (* keep = 32'd1 *)\n  wire {found['name']}_top;\n", module)
    tops = "".join(f"  assign {name}_top = {name}[{top}];\n" for name, top in kept)
    return f"{module.removesuffix('endmodule')}{tops}endmodule"


def _in_rtlil(module: str) -> str:
    kept = [(found["name"], int(found["width"]) - 1) for found in _RTLIL_KEPT.finditer(module)]
    module = _RTLIL_KEPT.sub(
        lambda found: f"{found['wire']}  attribute \\keep 1\n  wire width 1 \\{found['name']}_top\n", module
    )
    tops = "".join(f"connect \\{name}_top \\{name} [{top}]\n" for name, top in kept)
    return f"{module.removesuffix('end')}{tops}end"
