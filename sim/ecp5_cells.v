// Models of ECP5 cells for simulation: those that Yosys has as black boxes only, and the flip-flop.
// They do what synth_ecp5 uses of the cells, and end the simulation where anything else is asked of them.

// Flip-flop. `START is its value at power-up as a function of what the bitstream says.
module TRELLIS_FF (input CLK, LSR, CE, DI, M, output reg Q);
  parameter GSR = "ENABLED";
  parameter [127:0] CEMUX = "1";
  parameter CLKMUX = "CLK";
  parameter LSRMUX = "LSR";
  parameter SRMODE = "LSR_OVER_CE";
  parameter REGSET = "RESET";
  parameter [127:0] LSRMODE = "LSR";

  wire enable = CEMUX == "1" ? 1'b1 : CEMUX == "INV" ? ~CE : CE;

  initial begin
    if (CLKMUX != "CLK" || LSRMUX != "LSR" || LSRMODE != "LSR" || SRMODE != "LSR_OVER_CE" ||
        (CEMUX != "1" && CEMUX != "CE" && CEMUX != "INV") || (REGSET != "SET" && REGSET != "RESET"))
      $fatal(1, "TRELLIS_FF must have a rising edge and a synchronous reset, unlike %m");
    Q = `START(REGSET == "SET");
  end

  always @(posedge CLK)
    if (LSR) Q <= REGSET == "SET";
    else if (enable) Q <= DI;
endmodule

// Multiplier block with its registers for both operands, for the product, or without; its operands from its own inputs.
// CE0 enables the registers of the operands, CE1 that of the product; they are never reset, and start at 0.
module MULT18X18D (
  input A17, A16, A15, A14, A13, A12, A11, A10, A9, A8, A7, A6, A5, A4, A3, A2, A1, A0,
  input B17, B16, B15, B14, B13, B12, B11, B10, B9, B8, B7, B6, B5, B4, B3, B2, B1, B0,
  input C17, C16, C15, C14, C13, C12, C11, C10, C9, C8, C7, C6, C5, C4, C3, C2, C1, C0,
  input SIGNEDA, SIGNEDB, SOURCEA, SOURCEB, CLK0, CE0, CE1, RST0,
  output P35, P34, P33, P32, P31, P30, P29, P28, P27, P26, P25, P24, P23, P22, P21, P20, P19, P18, P17, P16, P15, P14,
  P13, P12, P11, P10, P9, P8, P7, P6, P5, P4, P3, P2, P1, P0
);
  parameter REG_INPUTA_CLK = "NONE";
  parameter REG_INPUTA_CE = "CE0";
  parameter REG_INPUTA_RST = "RST0";
  parameter REG_INPUTB_CLK = "NONE";
  parameter REG_INPUTB_CE = "CE0";
  parameter REG_INPUTB_RST = "RST0";
  parameter REG_INPUTC_CLK = "NONE";
  parameter REG_PIPELINE_CLK = "NONE";
  parameter REG_OUTPUT_CLK = "NONE";
  parameter REG_OUTPUT_CE = "CE0";
  parameter REG_OUTPUT_RST = "RST0";
  parameter MULT_BYPASS = "DISABLED";
  parameter [127:0] RESETMODE = "SYNC";
  parameter [127:0] GSR = "ENABLED";

  wire [17:0] next_a = {
    A17, A16, A15, A14, A13, A12, A11, A10, A9, A8, A7, A6, A5, A4, A3, A2, A1, A0
  };
  wire [17:0] next_b = {
    B17, B16, B15, B14, B13, B12, B11, B10, B9, B8, B7, B6, B5, B4, B3, B2, B1, B0
  };
  reg [17:0] held_a = 18'd0, held_b = 18'd0;
  reg [35:0] held_product = 36'd0;
  wire [17:0] a = REG_INPUTA_CLK == "CLK0" ? held_a : next_a;
  wire [17:0] b = REG_INPUTB_CLK == "CLK0" ? held_b : next_b;
  // A 19th bit repeats the sign of a signed operand and is 0 for an unsigned one.
  wire signed [18:0] wide_a = {SIGNEDA & a[17], a};
  wire signed [18:0] wide_b = {SIGNEDB & b[17], b};
  wire signed [37:0] product = wide_a * wide_b;
  assign {
    P35, P34, P33, P32, P31, P30, P29, P28, P27, P26, P25, P24, P23, P22, P21, P20, P19, P18, P17, P16, P15, P14,
    P13, P12, P11, P10, P9, P8, P7, P6, P5, P4, P3, P2, P1, P0
  } = REG_OUTPUT_CLK == "CLK0" ? held_product : product[35:0];

  always @(posedge CLK0) begin
    if (CE0) held_a <= next_a;
    if (CE0) held_b <= next_b;
    if (CE1) held_product <= product[35:0];
    if (RST0) $fatal(1, "MULT18X18D must have registers that are never reset, unlike %m");
  end

  initial
    if ((REG_INPUTA_CLK != "NONE" && REG_INPUTA_CLK != "CLK0") ||
        (REG_INPUTB_CLK != "NONE" && REG_INPUTB_CLK != "CLK0") || REG_INPUTC_CLK != "NONE" ||
        REG_INPUTA_CE != "CE0" || REG_INPUTB_CE != "CE0" ||
        (REG_OUTPUT_CLK != "NONE" && REG_OUTPUT_CE != "CE1") ||
        REG_PIPELINE_CLK != "NONE" || (REG_OUTPUT_CLK != "NONE" && REG_OUTPUT_CLK != "CLK0") ||
        MULT_BYPASS != "DISABLED" || RESETMODE != "SYNC" || (GSR != "ENABLED" && GSR != "DISABLED"))
      $fatal(1, "MULT18X18D must have no other register and no bypass, unlike %m");
  always @(SOURCEA, SOURCEB)
    if (SOURCEA | SOURCEB) $fatal(1, "MULT18X18D must take A and B, not shifted operands as in %m");
endmodule

// Block RAM of 1,024 words of 18 bits, with or without output registers, which are always enabled. A port of 36 bits has the data pins of both ports:
// A is the one that writes, B the one that reads. In words of 18 and 36 bits the lowest address bits enable bytes of
// 9 bits. A port that reads what the other writes at the same edge gets the old word.
module DP16KD (
  input DIA17, DIA16, DIA15, DIA14, DIA13, DIA12, DIA11, DIA10, DIA9, DIA8, DIA7, DIA6, DIA5, DIA4, DIA3, DIA2, DIA1,
  DIA0,
  input ADA13, ADA12, ADA11, ADA10, ADA9, ADA8, ADA7, ADA6, ADA5, ADA4, ADA3, ADA2, ADA1, ADA0,
  input CEA, OCEA, CLKA, WEA, RSTA, CSA2, CSA1, CSA0,
  output DOA17, DOA16, DOA15, DOA14, DOA13, DOA12, DOA11, DOA10, DOA9, DOA8, DOA7, DOA6, DOA5, DOA4, DOA3, DOA2, DOA1,
  DOA0,
  input DIB17, DIB16, DIB15, DIB14, DIB13, DIB12, DIB11, DIB10, DIB9, DIB8, DIB7, DIB6, DIB5, DIB4, DIB3, DIB2, DIB1,
  DIB0,
  input ADB13, ADB12, ADB11, ADB10, ADB9, ADB8, ADB7, ADB6, ADB5, ADB4, ADB3, ADB2, ADB1, ADB0,
  input CEB, OCEB, CLKB, WEB, RSTB, CSB2, CSB1, CSB0,
  output DOB17, DOB16, DOB15, DOB14, DOB13, DOB12, DOB11, DOB10, DOB9, DOB8, DOB7, DOB6, DOB5, DOB4, DOB3, DOB2, DOB1,
  DOB0
);
  parameter integer DATA_WIDTH_A = 18;
  parameter integer DATA_WIDTH_B = 18;
  parameter REGMODE_A = "NOREG";
  parameter REGMODE_B = "NOREG";
  parameter RESETMODE = "SYNC";
  parameter ASYNC_RESET_RELEASE = "SYNC";
  parameter CSDECODE_A = "0b000";
  parameter CSDECODE_B = "0b000";
  parameter [127:0] WRITEMODE_A = "NORMAL";
  parameter [127:0] WRITEMODE_B = "NORMAL";
  parameter CLKAMUX = "CLKA";
  parameter CLKBMUX = "CLKB";
  parameter GSR = "ENABLED";
  parameter [319:0]
    INITVAL_00 = 0, INITVAL_01 = 0, INITVAL_02 = 0, INITVAL_03 = 0, INITVAL_04 = 0, INITVAL_05 = 0, INITVAL_06 = 0,
    INITVAL_07 = 0, INITVAL_08 = 0, INITVAL_09 = 0, INITVAL_0A = 0, INITVAL_0B = 0, INITVAL_0C = 0, INITVAL_0D = 0,
    INITVAL_0E = 0, INITVAL_0F = 0, INITVAL_10 = 0, INITVAL_11 = 0, INITVAL_12 = 0, INITVAL_13 = 0, INITVAL_14 = 0,
    INITVAL_15 = 0, INITVAL_16 = 0, INITVAL_17 = 0, INITVAL_18 = 0, INITVAL_19 = 0, INITVAL_1A = 0, INITVAL_1B = 0,
    INITVAL_1C = 0, INITVAL_1D = 0, INITVAL_1E = 0, INITVAL_1F = 0, INITVAL_20 = 0, INITVAL_21 = 0, INITVAL_22 = 0,
    INITVAL_23 = 0, INITVAL_24 = 0, INITVAL_25 = 0, INITVAL_26 = 0, INITVAL_27 = 0, INITVAL_28 = 0, INITVAL_29 = 0,
    INITVAL_2A = 0, INITVAL_2B = 0, INITVAL_2C = 0, INITVAL_2D = 0, INITVAL_2E = 0, INITVAL_2F = 0, INITVAL_30 = 0,
    INITVAL_31 = 0, INITVAL_32 = 0, INITVAL_33 = 0, INITVAL_34 = 0, INITVAL_35 = 0, INITVAL_36 = 0, INITVAL_37 = 0,
    INITVAL_38 = 0, INITVAL_39 = 0, INITVAL_3A = 0, INITVAL_3B = 0, INITVAL_3C = 0, INITVAL_3D = 0, INITVAL_3E = 0,
    INITVAL_3F = 0;
  // 18 bits lie 20 bits apart.
  localparam [20479:0] CONTENT = {
    INITVAL_3F, INITVAL_3E, INITVAL_3D, INITVAL_3C, INITVAL_3B, INITVAL_3A, INITVAL_39, INITVAL_38, INITVAL_37,
    INITVAL_36, INITVAL_35, INITVAL_34, INITVAL_33, INITVAL_32, INITVAL_31, INITVAL_30, INITVAL_2F, INITVAL_2E,
    INITVAL_2D, INITVAL_2C, INITVAL_2B, INITVAL_2A, INITVAL_29, INITVAL_28, INITVAL_27, INITVAL_26, INITVAL_25,
    INITVAL_24, INITVAL_23, INITVAL_22, INITVAL_21, INITVAL_20, INITVAL_1F, INITVAL_1E, INITVAL_1D, INITVAL_1C,
    INITVAL_1B, INITVAL_1A, INITVAL_19, INITVAL_18, INITVAL_17, INITVAL_16, INITVAL_15, INITVAL_14, INITVAL_13,
    INITVAL_12, INITVAL_11, INITVAL_10, INITVAL_0F, INITVAL_0E, INITVAL_0D, INITVAL_0C, INITVAL_0B, INITVAL_0A,
    INITVAL_09, INITVAL_08, INITVAL_07, INITVAL_06, INITVAL_05, INITVAL_04, INITVAL_03, INITVAL_02, INITVAL_01,
    INITVAL_00
  };

  wire [13:0] address_a = {
    ADA13, ADA12, ADA11, ADA10, ADA9, ADA8, ADA7, ADA6, ADA5, ADA4, ADA3, ADA2, ADA1, ADA0
  };
  wire [13:0] address_b = {
    ADB13, ADB12, ADB11, ADB10, ADB9, ADB8, ADB7, ADB6, ADB5, ADB4, ADB3, ADB2, ADB1, ADB0
  };
  wire [17:0] data_a = {
    DIA17, DIA16, DIA15, DIA14, DIA13, DIA12, DIA11, DIA10, DIA9, DIA8, DIA7, DIA6, DIA5, DIA4, DIA3, DIA2, DIA1,
    DIA0
  };
  wire [17:0] data_b = {
    DIB17, DIB16, DIB15, DIB14, DIB13, DIB12, DIB11, DIB10, DIB9, DIB8, DIB7, DIB6, DIB5, DIB4, DIB3, DIB2, DIB1,
    DIB0
  };
  wire [17:0] mask_a = mask(address_a, DATA_WIDTH_A) & {18{CEA & WEA}};
  wire [17:0] mask_b = mask(address_b, DATA_WIDTH_B) & {18{CEB & WEB}};

  reg [17:0] memory[0:1023];
  reg [17:0] low, high, read_a, read_b; // read by a port of 36 bits, and by each port of fewer
  reg [17:0] out_a = 18'd0, out_b = 18'd0; // behind them
  wire [17:0] word_a = DATA_WIDTH_B == 36 ? low : read_a;
  wire [17:0] word_b = DATA_WIDTH_B == 36 ? high : read_b;
  integer i;

  assign {
    DOA17, DOA16, DOA15, DOA14, DOA13, DOA12, DOA11, DOA10, DOA9, DOA8, DOA7, DOA6, DOA5, DOA4, DOA3, DOA2, DOA1,
    DOA0
  } = REGMODE_A == "OUTREG" ? out_a : word_a;
  assign {
    DOB17, DOB16, DOB15, DOB14, DOB13, DOB12, DOB11, DOB10, DOB9, DOB8, DOB7, DOB6, DOB5, DOB4, DOB3, DOB2, DOB1,
    DOB0
  } = REGMODE_B == "OUTREG" ? out_b : word_b;

  initial begin
    if ((REGMODE_A != "NOREG" && REGMODE_A != "OUTREG") || (REGMODE_B != "NOREG" && REGMODE_B != "OUTREG") ||
        (DATA_WIDTH_B == 36 ? REGMODE_A != REGMODE_B : REGMODE_A != "NOREG") || CLKAMUX != "CLKA" || CLKBMUX != "CLKB" ||
        CSDECODE_A != "0b000" || CSDECODE_B != "0b000")
      $fatal(1, "DP16KD must have rising edges, no register at an output alone and no decoder, unlike %m");
    for (i = 0; i < 1024; i = i + 1) memory[i] = CONTENT[20*i +: 18];
    low = 18'($urandom);
    high = 18'($urandom);
    read_a = 18'($urandom);
    read_b = 18'($urandom);
  end

  always @(posedge CLKA) begin
    if (RSTA | CSA2 | CSA1 | CSA0) $fatal(1, "DP16KD must have no reset and no chip select, unlike %m");
    if (DATA_WIDTH_A == 36) begin
      store({address_a[13:5], 1'b0}, data_a, mask_a);
      store({address_a[13:5], 1'b1}, data_b, mask({12'b0, address_a[3:2]}, 18) & {18{CEA & WEA}});
    end else begin
      store(address_a[13:4], data_a << place(address_a, DATA_WIDTH_A), mask_a);
      if (CEA & (~WEA | WRITEMODE_A == "READBEFOREWRITE"))
        read_a <= memory[address_a[13:4]] >> place(address_a, DATA_WIDTH_A);
      else if (CEA & WRITEMODE_A == "WRITETHROUGH") read_a <= data_a;
    end
  end

  always @(posedge CLKB) begin
    out_a <= word_a;
    out_b <= word_b;
    if (REGMODE_B == "OUTREG" && (!OCEB || (DATA_WIDTH_B == 36 && !OCEA)))
      $fatal(1, "DP16KD must have output registers that are always enabled, unlike %m");
    if (RSTB | CSB2 | CSB1 | CSB0) $fatal(1, "DP16KD must have no reset and no chip select, unlike %m");
    if (DATA_WIDTH_B == 36) begin
      if (WEB) $fatal(1, "DP16KD must write 36 bits by port A, unlike %m");
      if (CEB) begin
        low <= memory[{address_b[13:5], 1'b0}];
        high <= memory[{address_b[13:5], 1'b1}];
      end
    end else begin
      store(address_b[13:4], data_b << place(address_b, DATA_WIDTH_B), mask_b);
      if (CEB & (~WEB | WRITEMODE_B == "READBEFOREWRITE"))
        read_b <= memory[address_b[13:4]] >> place(address_b, DATA_WIDTH_B);
      else if (CEB & WRITEMODE_B == "WRITETHROUGH") read_b <= data_b;
    end
  end

  task store(input [9:0] word, input [17:0] data, input [17:0] mask);
    if (|mask) memory[word] <= (memory[word] & ~mask) | (data & mask);
  endtask

  // Lowest bit of a port's word within 18 bits, which are two bytes of 9.
  function [4:0] place(input [13:0] address, input integer width);
    case (width)
      9: place = address[3] ? 9 : 0;
      4: place = (address[3] ? 9 : 0) + 4 * address[2];
      2: place = (address[3] ? 9 : 0) + 2 * address[2:1];
      1: place = (address[3] ? 9 : 0) + address[2:0];
      default: place = 0;
    endcase
  endfunction

  // The bits among 18 that a port's word takes.
  function [17:0] mask(input [13:0] address, input integer width);
    if (width >= 18) mask = {{9{address[1]}}, {9{address[0]}}};
    else mask = ((18'd1 << width) - 18'd1) << place(address, width);
  endfunction
endmodule
