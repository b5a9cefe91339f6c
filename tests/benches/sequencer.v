// Puts a batch of rows through a component and keeps what its ports carried: see harness.py.
//
// A row is its inputs and, above them, how many clocks later than the next clock the next row comes. Its strobe is one
// clock long; its inputs stay until the next row's. A clock at which a watched port is high is an event.
//
// The records are written by a blocking assignment, for a word so wide would else be copied at every clock; nothing
// reads them at the clock's edge.

module bench_sequencer #(
    parameter INPUTS = 1,
    parameter SEEN = 1,
    parameter BATCH = 16,
    parameter SPACING = 16
) (
    input clk,
    input rst,
    input go,                                         // its change starts a batch
    input [7:0] length,                               // rows in the batch
    input [BATCH*(SPACING+INPUTS)-1:0] rows,          // the first one lowest
    input [INPUTS-1:0] strobe,                        // the inputs that are high in the first clock of a row
    input [SEEN-1:0] watched,                         // the ports that make an event
    input [SEEN-1:0] seen,                            // all ports
    output [INPUTS-1:0] driven,                       // all inputs
    output reg busy,                                  // from the start of a batch to the end of its last row
    output reg [15:0] events,                         // how many events the batch had
    output reg [2*BATCH*(32+SEEN)-1:0] records        // the events: all ports, and above them the number of the clock
);
  reg gone, first;
  reg [7:0] index;
  reg [SPACING-1:0] spacing;
  reg [INPUTS-1:0] inputs;
  reg [31:0] clock;

  assign driven = inputs | (first ? strobe : {INPUTS{1'b0}});

  always @(posedge clk) begin
    clock <= clock + 1;
    spacing <= spacing - 1;
    first <= 0;
    if (rst) begin
      gone <= 0;
      busy <= 0;
      inputs <= 0;
    end else if (go != gone) begin
      gone <= go;
      busy <= 1;
      index <= 0;
      spacing <= 0;
      clock <= 0;
      events <= 0;
    end else if (busy) begin
      if (spacing == 0 && index == length) busy <= 0;
      else if (spacing == 0) begin
        {spacing, inputs} <= rows[index*(SPACING+INPUTS)+:SPACING+INPUTS];
        index <= index + 1;
        first <= 1;
      end
      if ((seen & watched) != 0) begin
        // verilator lint_off BLKSEQ
        if (events < 2 * BATCH) records[events*(32+SEEN)+:32+SEEN] = {clock, seen};
        // verilator lint_on BLKSEQ
        events <= events + 1;
      end
    end
  end
endmodule
