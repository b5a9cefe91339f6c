`include "rounding.vh"

// The mean of the last four samples, rounded down, one clock after `strobe`.
module mean4 #(parameter WIDTH = 16) (
  input clk, input rst,
  input strobe, input signed [WIDTH-1:0] sample,
  output reg valid, output reg signed [WIDTH-1:0] mean
);
  reg signed [WIDTH-1:0] last [0:2];
  wire signed [WIDTH+1:0] sum = sample + last[0] + last[1] + last[2];
  integer k;
  always @(posedge clk)
    if (rst) begin
      valid <= 0;
      for (k = 0; k < 3; k = k + 1) last[k] <= 0;
    end else begin
      valid <= strobe;
      if (strobe) begin
        mean <= `ROUNDED_DOWN(sum, 2);
        last[0] <= sample;
        last[1] <= last[0];
        last[2] <= last[1];
      end
    end
endmodule
