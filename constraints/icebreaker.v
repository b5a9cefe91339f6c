// The internal oscillator of the iCEBreaker's part, an iCE40UP5K: 48 MHz, divided: 6 MHz.

module internal_oscillator (output clk);
    SB_HFOSC #(.CLKHF_DIV("0b11")) hfosc (.CLKHFPU(1'b1), .CLKHFEN(1'b1), .CLKHF(clk));
endmodule
