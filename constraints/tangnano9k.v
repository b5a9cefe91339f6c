// The internal oscillator of the Tang Nano 9K's part, a GW1NR-9C: 250 MHz within 5 %, divided: 6.25 MHz.

module internal_oscillator (output clk);
    wire divided;

    OSC #(.FREQ_DIV(40), .DEVICE("GW1NR-9C")) osc (.OSCOUT(divided));

    // Without it the clock takes ordinary wires to each of its registers, late by more than a register to the next.
    BUFG buffer (.I(divided), .O(clk));
endmodule
