// The amplifiers behind a board's drive stages in simulation: each follows the pins, and shows at every tick how many
// steps of force there are. A bridge or pulses without a pause have one step; a DAC has one for each code.

module pdm_amplifier (
    input drive_pdm, drive_sign,
    output signed [31:0] steps
);
  assign steps = !drive_pdm ? 0 : drive_sign ? -1 : 1;
endmodule

// A current goes on through both low gates, or through a diode and a low gate, without volts.
module pwm_amplifier (
    input gate_high_a, gate_low_a, gate_high_b, gate_low_b,
    output signed [31:0] steps,
    output shot                    // both gates of a leg are on
);
  assign steps = gate_high_a && gate_low_b ? 1 : gate_high_b && gate_low_a ? -1 : 0;
  assign shot = gate_high_a && gate_low_a || gate_high_b && gate_low_b;
endmodule

// A DAC that counts the bits of a frame and takes it at the rise of its chip select. While its clear is low it is at its
// middle code, and forgets what it was told: where it needs a setup, it makes no volts until it has heard that again.
module dac_amplifier #(
    parameter BITS = 16, HEADER_BITS = 0, HEADER = 0, TRAILING_BITS = 0,
    parameter FLIP = 1,            // codes are in offset binary
    parameter TAKES = 1,           // the level of the serial clock behind the edge at which a bit is taken
    parameter OFFSET = 0,          // the code without force
    parameter NEEDS = 0,           // frames of setup, without which there are no volts
    parameter [63:0] SETUP = 0     // the last of them
) (
    input tick,
    input dac_cs_n, dac_sclk, dac_mosi, dac_clear_n,
    output signed [31:0] steps
);
  localparam FRAME_BITS = HEADER_BITS + BITS + TRAILING_BITS;
  reg [63:0] frame = 0;
  reg [31:0] count = 0;
  reg clock = 0, selected = 0, told = 0;
  reg signed [31:0] code = 0;
  wire [63:0] header = frame >> (BITS + TRAILING_BITS);
  wire [BITS-1:0] coded = BITS'(frame >> TRAILING_BITS) ^ BITS'(FLIP << (BITS - 1));
  always @(posedge tick) begin
    clock <= dac_sclk;
    selected <= !dac_cs_n;
    if (dac_cs_n) count <= 0;
    else if (dac_sclk != clock && dac_sclk == TAKES[0]) begin
      frame <= {frame[62:0], dac_mosi} & ((64'd1 << FRAME_BITS) - 1);
      count <= count + 1;
    end
    if (!dac_clear_n) begin
      code <= 0;
      told <= 0;
    end else if (dac_cs_n && selected && count == FRAME_BITS) begin
      if (NEEDS != 0 && !told && frame == SETUP) told <= 1;
      else if (header == HEADER) code <= 32'(signed'(coded));
    end
  end
  assign steps = dac_clear_n && (NEEDS == 0 || told) ? code - OFFSET : 0;
endmodule
