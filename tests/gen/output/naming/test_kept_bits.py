"""Of a sum that synthesis must leave alone, one bit is kept, and never the whole."""

import re

from tests.gen.designs import parallel_design

from sosmith.gen.output.naming.kept_bits import rtlil_with_kept_bits, with_kept_bits
from sosmith.gen.output.verilog import core_texts

VERILOG = """module a(x, y);
  (* keep = 32'd1 *)
  wire signed [34:0] total;
  (* keep = 32'd1 *)
  wire bit;
  wire [3:0] other;
  (* keep = 32'd1 *)
  wire [1:0] second;
  assign total = x + 34'h3ac080000;
endmodule

module b(x);
  wire [3:0] total;
endmodule
"""
RTLIL = r"""module \a
  attribute \keep 1
  wire width 35 signed \total
  attribute \keep 1
  wire width 1 \bit
  wire width 4 \other
  connect \total \other
end
module \b
  attribute \keep 1
  wire width 10 \last
end
"""


def test_the_top_bit_of_each_kept_wire_is_kept() -> None:
    attribute = "  (* keep = 32'd1 *)\n"
    wanted = VERILOG
    for wire, name in (("  wire signed [34:0] total;\n", "total"), ("  wire [1:0] second;\n", "second")):
        wanted = wanted.replace(f"{attribute}{wire}", f"{wire}{attribute}  wire {name}_top;\n")
    tops = "  assign total_top = total[34];\n  assign second_top = second[1];\nendmodule\n\nmodule b"
    assert with_kept_bits(VERILOG) == wanted.replace("endmodule\n\nmodule b", tops)


def test_so_it_is_in_rtlil() -> None:
    text = rtlil_with_kept_bits(RTLIL)
    assert text.count("attribute \\keep 1\n  wire width 1 ") == text.count("attribute \\keep") == 3
    assert "connect \\total_top \\total [34]\nend\nmodule \\b" in text
    assert text.endswith("connect \\last_top \\last [9]\nend\n")


def test_no_core_keeps_a_sum_as_a_whole() -> None:
    """Yosys 0.70 loses drivers of bits that such a sum has from an operand."""
    verilog, rtlil = core_texts(parallel_design("flange_wear_bench.toml"))
    kept = re.findall(r"\(\* keep = .*\*\)\n *(.*);", verilog)
    assert len(kept) > 4
    assert [net for net in kept if not re.fullmatch(r"wire \w+_top", net)] == []
    widths = re.findall(r"attribute \\keep 1\n +wire width (\d+) ", rtlil)
    assert {*widths} == {"1"}
    assert len(widths) == len(kept)
