// What is around a board in simulation: its clocks, the other end of its serial line, and an amplifier that follows its
// pulses. Like the axis's harness it makes any number of clocks for one change of `go`, in a single evaluation.
//
// Time is counted in ticks, the periods of the board's clock. The oscillator goes on where that clock stands.

module around_board #(
    parameter BIT_PARTS = 3328,        // the serial line's bit, in parts of a clock, 256 each
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
    output reg signed [31:0] pulses,   // clocks of full drive that the amplifier has taken, less the negative ones
    output reg [31:0] heard,           // bytes from the board, of which the last 1024 are kept
    output [7:0] heard_byte            // the byte of that number
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

  wire uart_tx, drive_pdm, drive_sign, alive, outputs_enable;
  board board(
    .clk(tick && !stopped), .rst(rst), .oscillator(oscillator),
    .encoder_a(encoder_a), .encoder_b(encoder_b), .encoder_z(encoder_z),
    .encoder_a_n(encoder_a_n), .encoder_b_n(encoder_b_n),
    .drive_enable(drive_enable), .external_fault(external_fault), .emergency_stop(emergency_stop),
    .uart_rx(uart_rx), .uart_tx(uart_tx),
    .drive_pdm(drive_pdm), .drive_sign(drive_sign), .alive(alive), .outputs_enable(outputs_enable)
  );

  // The amplifier's inputs are pulled down where the board leaves them.
  initial pulses = 0;
  always @(posedge tick)
    if (drive_pdm && outputs_enable) pulses <= drive_sign ? pulses - 1 : pulses + 1;

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
