// Model of the flip-flop of a GateMate, for simulation; Yosys has models of its other cells.

// `START is its value at power-up as a function of what the bitstream says.
module CC_DFF (input D, CLK, EN, SR, output reg Q);
  parameter CLK_INV = 1'b0;
  parameter EN_INV = 1'b0;
  parameter SR_INV = 1'b0;
  parameter SR_VAL = 1'b0;
  parameter INIT = 1'bx;

  wire clk = CLK ^ CLK_INV;
  wire enable = EN ^ EN_INV;
  wire set_reset = SR ^ SR_INV;

  initial Q = `START(INIT);

  always @(posedge clk or posedge set_reset)
    if (set_reset) Q <= SR_VAL;
    else if (enable) Q <= D;
endmodule
