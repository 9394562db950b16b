// A core for the bench, sound with fault 0, that breaks the rules of its streams in many ways.
//
//                 +--------+   work clocks    +--------+
//   s_axis ------>|   x    |----------------->| second |---> head ---> m_axis
//                 +--------+  (none: at once) +--------+
//
// y = x + 3, tdest goes along, tuser = the lowest bits of x. Faults act from the 80th sample on, but where said.
module faulty(
  input aclk, input aresetn, input [4:0] fault, input [7:0] work,
  input [1:0] s_axis_tdest, input [15:0] s_axis_tdata, input s_axis_tvalid, output s_axis_tready,
  output [1:0] m_axis_tdest, output [15:0] m_axis_tdata, output [1:0] m_axis_tuser, output m_axis_tvalid,
  input m_axis_tready
);
  reg [17:0] x, head, second;
  reg [15:0] count;
  reg [7:0] left, age = 0;
  reg valid, full;
  wire late = count >= 80;
  wire take = s_axis_tvalid & s_axis_tready;
  wire push = work == 0 ? take : left == 1;
  wire [17:0] source = work == 0 ? {s_axis_tdest, s_axis_tdata} : x;
  wire [15:0] old = fault == 13 && age > 100 ? 1 : 0; // at any time
  wire [17:0] result = {source[17:16], source[15:0] + 16'd3 + old};
  wire ready = ~full & left == 0;
  assign s_axis_tready =
    fault == 1 & late ? ready | m_axis_tready :
    fault == 2 & late ? ready & s_axis_tvalid :
    fault == 3 ? ready & ~late : ready;
  assign m_axis_tvalid =
    fault == 4 ? valid & m_axis_tready : // at any time
    fault == 5 & late ? valid | s_axis_tvalid :
    fault == 6 ? valid & ~late : valid;
  assign {m_axis_tdest, m_axis_tdata} = fault == 7 & late ? head ^ {17'b0, m_axis_tready} : head;
  assign m_axis_tuser = head[1:0] ^ (fault == 8 & late ? {2{full}} : 2'b0);
  always_ff @(posedge aclk)
    if (fault != 13) age <= 0;
    else if (take & age < 200) age <= age + 1;
  always_ff @(posedge aclk)
    if (!aresetn) begin
      valid <= 0; full <= 0; count <= 0; left <= 0;
    end else begin
      if (take) begin
        count <= count + 1; x <= {s_axis_tdest, s_axis_tdata}; left <= work;
      end
      if (left != 0) left <= left - 1;
      if (m_axis_tready | ~valid) begin
        head <= full ? second : result;
        valid <= full | push | (fault == 9 & count == 200);
        full <= fault == 10 & late & full & count[2:0] == 5;
      end else begin
        if (push) begin second <= result; full <= ~(fault == 11 & late); end
        if (fault == 12 & late) valid <= 0;
        if (fault == 14 & late) head[17:16] <= ~head[17:16];
        if (fault == 15 & late & push) head <= result;
      end
    end
endmodule
