// What is around a board in simulation: its clocks, the other end of its serial line, and the amplifier of its drive
// stage, which is that of the macro STAGE_PDM, STAGE_PWM or STAGE_DAC. GUARDED and PERMITTED are signals inside the board.
// Like the axis's harness it makes any number of clocks for one change of `go`, in a single evaluation.
//
// Time is counted in ticks, the periods of the board's clock. The oscillator goes on where that clock stands.

module around_board #(
    parameter BIT_PARTS = 3328,        // the serial line's bit, in parts of a clock, 256 each
`ifdef STAGE_DAC
    parameter DAC_BITS = 16, DAC_HEADER_BITS = 0, DAC_HEADER = 0, DAC_TRAILING_BITS = 0,
    parameter DAC_FLIP = 1, DAC_TAKES = 1, DAC_OFFSET = 0, DAC_NEEDS = 0,   // see dac_amplifier
    parameter [63:0] DAC_SETUP = 0,
`endif
    parameter OSCILLATOR_CLOCKS = 2    // half a period of the oscillator
) (
    input go,
    input [31:0] clocks,
    input stopped,                     // the board's clock stands
    input rst,
    input encoder_a, encoder_b, encoder_z, encoder_a_n, encoder_b_n,
    input drive_enable, external_fault, emergency_stop,
    input uart_rx,
    input [9:0] heard_index,
    output reg signed [63:0] given,    // the sum of the amplifier's steps at all ticks
    output reg shot,                   // both gates of a leg of a bridge have been on
    output reg [31:0] heard,           // bytes from the board, of which the last 1024 are kept
    output [7:0] heard_byte,           // the byte of that number
    output guarded,                    // a guard of `board_resting.py` is high
    output signed [31:0] pulse         // the step of a pulse
);
  reg tick = 0, gone = 0;
  reg [31:0] left = 0;
  always @(go or posedge tick or negedge tick)
    if (tick) tick <= 0;
    else if (go != gone) begin
      gone <= go;
      left <= clocks - 1;
      tick <= 1;
    end else if (left != 0) begin
      left <= left - 1;
      tick <= 1;
    end

  reg oscillator = 0;
  reg [31:0] until_change = 0;
  always @(posedge tick)
    if (until_change != 0) until_change <= until_change - 1;
    else begin
      until_change <= OSCILLATOR_CLOCKS - 1;
      oscillator <= !oscillator;
    end

  wire uart_tx, alive, outputs_enable;
  wire signed [31:0] steps;
`ifdef STAGE_PWM
  wire gate_high_a, gate_low_a, gate_high_b, gate_low_b, shoots;
`elsif STAGE_DAC
  wire dac_cs_n, dac_sclk, dac_mosi, dac_clear_n;
`else
  wire drive_pdm, drive_sign;
`endif
  board board(
    .clk(tick && !stopped), .rst(rst), .oscillator(oscillator),
    .encoder_a(encoder_a), .encoder_b(encoder_b), .encoder_z(encoder_z),
    .encoder_a_n(encoder_a_n), .encoder_b_n(encoder_b_n),
    .drive_enable(drive_enable), .external_fault(external_fault), .emergency_stop(emergency_stop),
    .uart_rx(uart_rx), .uart_tx(uart_tx),
`ifdef STAGE_PWM
    .gate_high_a(gate_high_a), .gate_low_a(gate_low_a), .gate_high_b(gate_high_b), .gate_low_b(gate_low_b),
`elsif STAGE_DAC
    .dac_cs_n(dac_cs_n), .dac_sclk(dac_sclk), .dac_mosi(dac_mosi), .dac_clear_n(dac_clear_n),
`else
    .drive_pdm(drive_pdm), .drive_sign(drive_sign),
`endif
    .alive(alive), .outputs_enable(outputs_enable)
  );

  // The amplifier's inputs are pulled to where they are safe while the board leaves them.
`ifdef STAGE_PWM
  pwm_amplifier amplifier(
    .gate_high_a(gate_high_a && outputs_enable), .gate_low_a(gate_low_a && outputs_enable),
    .gate_high_b(gate_high_b && outputs_enable), .gate_low_b(gate_low_b && outputs_enable),
    .steps(steps), .shot(shoots)
  );
`elsif STAGE_DAC
  dac_amplifier #(
    .BITS(DAC_BITS), .HEADER_BITS(DAC_HEADER_BITS), .HEADER(DAC_HEADER), .TRAILING_BITS(DAC_TRAILING_BITS),
    .FLIP(DAC_FLIP), .TAKES(DAC_TAKES), .OFFSET(DAC_OFFSET), .NEEDS(DAC_NEEDS), .SETUP(DAC_SETUP)
  ) amplifier(
    .tick(tick), .dac_cs_n(dac_cs_n || !outputs_enable), .dac_sclk(dac_sclk), .dac_mosi(dac_mosi),
    .dac_clear_n(dac_clear_n && outputs_enable), .steps(steps)
  );
`else
  pdm_amplifier amplifier(.drive_pdm(drive_pdm && outputs_enable), .drive_sign(drive_sign), .steps(steps));
`endif
`ifdef PERMITTED
  assign pulse = !(`PERMITTED && outputs_enable) ? 0 : drive_sign ? -1 : 1;
`else
  assign pulse = 0;
`endif
  assign guarded = `GUARDED;
  initial given = 0;
  initial shot = 0;
  always @(posedge tick) begin
    given <= given + 64'(steps);
`ifdef STAGE_PWM
    shot <= shot || shoots;
`endif
  end

  // The receiver of the host: half a bit after a start bit's edge, and then a bit apart.
  reg [7:0] bytes [0:1023];
  reg [8:0] shift = 0;
  reg [3:0] bits = 0;
  reg rested = 0;                      // the line has been high since the last byte
  reg [31:0] parts = 0;
  initial heard = 0;
  assign heard_byte = bytes[heard_index];
  always @(posedge tick)
    if (bits == 0) begin
      rested <= uart_tx;
      if (!uart_tx && rested) begin
        bits <= 10;
        parts <= BIT_PARTS / 2;
      end
    end else if (parts >= 256) parts <= parts - 256;
    else begin
      parts <= parts + BIT_PARTS - 256;
      bits <= bits - 1;
      shift <= {uart_tx, shift[8:1]};
      // The ninth bit is the last of the byte; the tenth is the stop bit, behind which the next byte may come at once.
      if (bits == 1) begin
        bytes[heard[9:0]] <= shift[8:1];
        heard <= heard + 1;
      end
    end
endmodule
