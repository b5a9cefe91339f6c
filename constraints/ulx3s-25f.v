// The internal oscillator of the ULX3S's part, an LFE5U: 310 MHz, divided: 2.4 MHz.

module internal_oscillator (output clk);
    OSCG #(.DIV(128)) oscg (.OSC(clk));
endmodule
