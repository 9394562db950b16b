"""Names that Verilog tools accept as identifiers."""

from __future__ import annotations

import re

MAX_NAME = 64
"""Maximum length of a name in characters; names derived from it stay within the limits of every tool."""

_WORDS = """
    accept_on alias always always_comb always_ff always_latch and assert assign assume automatic before
    begin bind bins binsof bit break buf bufif0 bufif1 byte case casex casez cell chandle checker class
    clocking cmos config const constraint context continue cover covergroup coverpoint cross deassign
    default defparam design disable dist do edge else end endcase endchecker endclass endclocking
    endconfig endfunction endgenerate endgroup endinterface endmodule endpackage endprimitive endprogram
    endproperty endsequence endspecify endtable endtask enum event eventually expect export extends extern
    final first_match for force foreach forever fork forkjoin function generate genvar global highz0
    highz1 if iff ifnone ignore_bins illegal_bins implements implies import incdir include initial inout
    input inside instance int integer interconnect interface intersect join join_any join_none large let
    liblist library local localparam logic longint macromodule matches medium modport module nand negedge
    nettype new nexttime nmos nor noshowcancelled not notif0 notif1 null or output package packed
    parameter pmos posedge primitive priority program property protected pull0 pull1 pulldown pullup
    pulsestyle_ondetect pulsestyle_onevent pure rand randc randcase randsequence rcmos real realtime ref
    reg reject_on release repeat restrict return rnmos rpmos rtran rtranif0 rtranif1 s_always s_eventually
    s_nexttime s_until s_until_with scalared sequence shortint shortreal showcancelled signed small soft
    solve specify specparam static string strong strong0 strong1 struct super supply0 supply1
    sync_accept_on sync_reject_on table tagged task this throughout time timeprecision timeunit tran
    tranif0 tranif1 tri tri0 tri1 triand trior trireg type typedef union unique unique0 unsigned until
    until_with untyped use uwire var vectored virtual void wait wait_order wand weak weak0 weak1 while
    wildcard wire with within wor xnor xor
"""

KEYWORDS = frozenset(_WORDS.split())
"""Reserved words of SystemVerilog (IEEE 1800-2017, Annex B), which include those of Verilog."""

OBEYED = re.compile(
    r"synopsys|synthesis|rtl_synthesis|ambit|cadence|exemplar|altera|xilinx|xlnx_\w*|quartus|vivado|pragma|protect"
    r"|verilator|verilint|verilog_lint|lint_\w*|spyglass|leda|translate_\w*|synth_\w*|synthesis_\w*|full_case"
    r"|parallel_case|one_hot|one_cold|infer_\w*|black_box|attribute|celldefine|surelint|svlint|slang|iverilog|yosys"
    r"|coverage|formal|vcs|ncsim|metacomment|vhdl_\w*",
    re.IGNORECASE,
)
"""Words that tools take for an order where a comment has them: the header has the name of the core."""

_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def is_identifier(name: str) -> bool:
    """Whether `name` is a simple identifier without ``$``, of at most `MAX_NAME` characters."""
    return len(name) <= MAX_NAME and _IDENTIFIER.fullmatch(name) is not None


def identifier_from(text: str) -> str:
    """Make an identifier of a text such as the name of a file.

    Examples
    --------
    >>> identifier_from("8 kHz notch"), identifier_from("output"), identifier_from("formal")
    ('filter_8_kHz_notch', 'filter_output', 'filter_formal')
    """
    name = re.sub(r"[^A-Za-z0-9_]+", "_", text).strip("_")[: MAX_NAME - len("filter_")]
    good = is_identifier(name) and name not in KEYWORDS and not OBEYED.fullmatch(name)
    return name if good else f"filter_{name}".rstrip("_")
