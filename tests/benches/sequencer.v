// Puts a batch of rows through a component and keeps what its ports carried: see harness.py and campaign.py.
//
// A row is its inputs and, above them, how many clocks later than the next clock the next row comes. Its strobe is one
// clock long; its inputs stay until the next row's, but for the momentary ones, which are complements from the second
// clock on. A clock at which a watched port is high is an event: the values of all ports and, above them, the number of
// the clock in the batch. The folder +scratch has the rows and gets the events, a hexadecimal word a line.
//
// A batch that starts while `bench_clk` is low makes its own clocks, in no time of the simulator: a single evaluation
// serves them all, and cocotb has no turn between them. A batch that starts while it is high takes the bench's clocks, as
// a waveform needs it.

module bench_sequencer #(
    parameter INPUTS = 1,
    parameter SEEN = 1,
    parameter SPACING = 16
) (
    input bench_clk,               // the clock between batches
    input rst,
    input go,                      // its change starts a batch
    input [INPUTS-1:0] strobe,     // the inputs that are high in the first clock of a row
    input [INPUTS-1:0] momentary,  // the inputs that mean something in the first clock of a row alone
    input [SEEN-1:0] watched,      // the ports that make an event
    input [SEEN-1:0] seen,         // all ports
    output clk,                    // the component's clock
    output [INPUTS-1:0] driven,    // all inputs
    output reg done,               // follows `go` at the end of the batch
    output reg [31:0] clocks       // of the batch so far
);
  reg extra = 0, begun = 0, first = 0;
  reg [INPUTS-1:0] inputs = 0, next;
  reg [SPACING-1:0] spacing;
  reg [SPACING+INPUTS-1:0] row;
  integer rows, events;
  string scratch;

  initial done = 0;
  initial if (!$value$plusargs("scratch=%s", scratch)) $fatal(1, "+scratch is missing");

  assign clk = bench_clk | extra;
  assign driven = first ? inputs | strobe : inputs ^ momentary;

  // A change of `go` wakes this process; it is no reset.
  // verilator lint_off SYNCASYNCNET
  always @(go or posedge extra or negedge extra) extra <= !extra && !bench_clk && !rst && go != done;
  // verilator lint_on SYNCASYNCNET

  always @(posedge clk) begin
    first <= 0;
    if (rst) begin
      inputs <= 0;
      begun <= 0;
      done <= go;
    end else if (go != done) begin
      begun <= 1;
      // What nothing else reads at this edge is assigned at once.
      // verilator lint_off BLKSEQ
      if (!begun) begin
        rows = $fopen({scratch, "/rows"}, "r");
        events = $fopen({scratch, "/events"}, "w");
        clocks = 0;
        spacing = 0;
      end
      if ((seen & watched) != 0) $fdisplay(events, "%h %h", clocks, seen);
      clocks = clocks + 1;
      if (spacing != 0) spacing = spacing - 1;
      else if ($fscanf(rows, "%h", row) == 1) begin
        {spacing, next} = row;
        inputs <= next;
        first <= 1;
      end else begin
        $fclose(rows);
        $fclose(events);
        begun <= 0;
        done <= go;
      end
      // verilator lint_on BLKSEQ
    end
  end
endmodule
