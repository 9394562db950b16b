"""A small hand-written core for the bench: y = x + 3 kept to 12 bits, and the same core broken in many ways."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np

from sosmith.gen.output.core_facts import InterfaceFacts, StreamFacts
from sosmith.hdl.plan.streams import fields
from sosmith.model.port import Port

INTERFACE = InterfaceFacts(
    name="stand_in",
    inputs=StreamFacts(fields=fields([Port(name="x", bits=11, signed=True, lsb=Fraction(1), zero=Fraction(0))])),
    outputs=StreamFacts(fields=fields([Port(name="y", bits=12, signed=True, lsb=Fraction(1), zero=Fraction(0))])),
    reset_cycles=0,
    latency_cycles=2,
)

SOUND = """
module stand_in(input aclk, input aresetn,
                input [15:0] s_axis_tdata, input s_axis_tvalid, output s_axis_tready,
                output [15:0] m_axis_tdata, output m_axis_tvalid, input m_axis_tready);
  reg [15:0] head, second, count;
  reg valid, full;
  wire take = s_axis_tvalid & s_axis_tready;
  wire [15:0] result = $signed(s_axis_tdata) + 16'sd3;
  assign s_axis_tready = ~full;
  assign m_axis_tdata = head;
  assign m_axis_tvalid = valid;
  always_ff @(posedge aclk)
    if (!aresetn) begin valid <= 0; full <= 0; count <= 0; end
    else begin
      if (take) count <= count + 1;
      if (m_axis_tready | ~valid) begin
        head <= full ? second : result; valid <= full | take; full <= 0;
      end else if (take) begin second <= result; full <= 1; end
    end
endmodule
"""

Break = Callable[[str], str]


def _replacing(old: str, new: str) -> Break:
    def apply(text: str) -> str:
        assert text.count(old) == 1, old
        return text.replace(old, new)

    return apply


BROKEN: dict[str, tuple[Break, str]] = {
    "drops a sample under stall": (
        _replacing("second <= result; full <= 1;", "second <= result; full <= (count != 40);"),
        "a sample must move at least every",
    ),
    "payload changes while stalled": (
        _replacing("else if (take) begin second", "else if (take) begin head <= result; second"),
        "a stalled core must not change m_axis_tdata from",
    ),
    "valid falls while stalled": (
        _replacing("full <= 1; end", "full <= 1; valid <= 0; end"),
        "a stalled core must not drop m_axis_tvalid",
    ),
    "valid waits for ready": (
        _replacing("m_axis_tvalid = valid", "m_axis_tvalid = valid & m_axis_tready"),
        "m_axis_tvalid must not wait for m_axis_tready",
    ),
    "ready follows ready within a clock": (
        _replacing("s_axis_tready = ~full", "s_axis_tready = ~full | m_axis_tready"),
        "outputs must not follow s_axis_tvalid or m_axis_tready within a clock",
    ),
    "ready follows valid within a clock": (
        _replacing("s_axis_tready = ~full", "s_axis_tready = ~full & s_axis_tvalid"),
        "outputs must not follow s_axis_tvalid or m_axis_tready within a clock",
    ),
    "a sample comes twice": (
        _replacing("valid <= full | take; full <= 0;", "valid <= full | take; full <= full && count[2:0] == 5;"),
        "samples must come out, not more",
    ),
    "it hangs": (
        _replacing("s_axis_tready = ~full", "s_axis_tready = ~full & (count < 100)"),
        "a sample must move at least every",
    ),
    "an extra sample at the end": (
        _replacing("valid <= full | take;", "valid <= full | take | (count == 300);"),
        "300 samples must come out, not more",
    ),
    "no reset": (
        _replacing("if (!aresetn) begin valid <= 0; full <= 0; count <= 0; end", "if (1'b0) begin end"),
        "m_axis_tvalid must be 0 or 1, not X",
    ),
    "memory across a reset": (
        _replacing(
            "wire [15:0] result = $signed(s_axis_tdata) + 16'sd3;",
            "reg [7:0] age = 0; always_ff @(posedge aclk) if (take && age < 200) age <= age + 1;\n"
            "wire [15:0] result = $signed(s_axis_tdata) + (age > 100) + 16'sd3;",
        ),
        "the first results after a reset must not depend on what came before it",
    ),
    "unknown bits": (
        _replacing("head <= full ? second : result;", "head <= full ? second : (count == 20) ? 16'hx0x0 : result;"),
        "m_axis_tdata must be known, not",
    ),
    "not extended by its sign": (
        _replacing("m_axis_tdata = head", "m_axis_tdata = {4'b0, head[11:0]}"),
        "y must be extended to whole bytes, not 0x",
    ),
}


def stimulus(samples: int = 300) -> np.ndarray:
    """Codes of the stand-in's input, of one channel."""
    return np.random.default_rng(11).integers(-1024, 1024, (samples, 1, 1))


def write(folder: Path, text: str = SOUND) -> Path:
    """Write a variant of the core."""
    path = folder / "stand_in.sv"
    path.write_text(text, encoding="utf-8")
    return path
