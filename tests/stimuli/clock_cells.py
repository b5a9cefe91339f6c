"""Models of the vendors' cells that make clocks, for simulation: each has the frequency that its parameters give."""

MODELS = r"""
`timescale 1ps/1ps

// A clock of a period, from the first edge of `pin` on; it locks after some edges of that.
module made_clock #(parameter real HALF_PS = 1000) (input pin, output reg clk = 0, output reg locked = 0);
    always begin
        #(HALF_PS) clk = ~clk;
    end
    initial begin
        repeat (100) @(posedge pin);
        locked = 1;
    end
endmodule

module EHXPLLL #(
    parameter FEEDBK_PATH = "", PLLRST_ENA = "", INTFB_WAKE = "", STDBY_ENABLE = "", DPHASE_SOURCE = "",
    parameter OUTDIVIDER_MUXA = "", OUTDIVIDER_MUXB = "", CLKOP_ENABLE = "DISABLED", CLKOS_ENABLE = "DISABLED",
    parameter CLKI_DIV = 0, CLKFB_DIV = 0, CLKOP_DIV = 0, CLKOS_DIV = 0,
    parameter CLKOP_CPHASE = 0, CLKOS_CPHASE = 0, CLKOP_FPHASE = 0, CLKOS_FPHASE = 0
) (
    input CLKI, CLKFB, RST, STDBY, PHASESEL0, PHASESEL1, PHASEDIR, PHASESTEP, PHASELOADREG, PLLWAKESYNC,
    input ENCLKOP, ENCLKOS, ENCLKOS2, ENCLKOS3,
    output CLKOP, CLKOS, CLKOS2, CLKOS3, LOCK, INTLOCK, REFCLK, CLKINTFB
);
    // It locks only if it is fed back, and its outputs are enabled.
    wire other;
    wire fed_back = CLKOP_ENABLE == "ENABLED" && CLKOS_ENABLE == "ENABLED" && FEEDBK_PATH == "CLKOP" && CLKFB === CLKOP;
    wire made;
    made_clock #(1e6 / 2 / (`OSCILLATOR_MHZ * CLKFB_DIV / CLKI_DIV)) fed (.pin(CLKI), .clk(CLKOP), .locked(other));
    made_clock #(1e6 / 2 / (`OSCILLATOR_MHZ * CLKFB_DIV * CLKOP_DIV / CLKI_DIV / CLKOS_DIV)) output_clock (
        .pin(CLKI), .clk(CLKOS), .locked(made)
    );
    assign LOCK = made & fed_back & ~RST & ~STDBY;
endmodule

module SB_PLL40_PAD #(
    parameter FEEDBACK_PATH = "", PLLOUT_SELECT = "",
    parameter [3:0] DIVR = 0, parameter [6:0] DIVF = 0, parameter [2:0] DIVQ = 0, FILTER_RANGE = 0
) (input PACKAGEPIN, RESETB, BYPASS, output PLLOUTGLOBAL, LOCK);
    wire made;
    made_clock #(1e6 / 2 / (`OSCILLATOR_MHZ * (DIVF + 1) / (DIVR + 1) / 2.0 ** DIVQ)) output_clock (
        .pin(PACKAGEPIN), .clk(PLLOUTGLOBAL), .locked(made)
    );
    assign LOCK = made & RESETB & ~BYPASS;
endmodule

module rPLL #(
    parameter DEVICE = "", FCLKIN = "", CLKFB_SEL = "", DYN_IDIV_SEL = "", DYN_FBDIV_SEL = "", DYN_ODIV_SEL = "",
    parameter IDIV_SEL = 0, FBDIV_SEL = 0, ODIV_SEL = 0
) (
    input CLKIN, CLKFB, RESET, RESET_P, input [5:0] FBDSEL, IDSEL, ODSEL, input [3:0] PSDA, DUTYDA, FDLY,
    output CLKOUT, CLKOUTP, CLKOUTD, CLKOUTD3, LOCK
);
    wire made;
    made_clock #(1e6 / 2 / (`OSCILLATOR_MHZ * (FBDIV_SEL + 1) / (IDIV_SEL + 1))) output_clock (
        .pin(CLKIN), .clk(CLKOUT), .locked(made)
    );
    assign LOCK = made & ~RESET & ~RESET_P;
endmodule

module OSCG #(parameter DIV = 0) (output reg OSC = 0);
    always #(1e6 / 2 * DIV / 310) OSC = ~OSC;
endmodule

module SB_HFOSC #(parameter CLKHF_DIV = "") (input CLKHFPU, CLKHFEN, output reg CLKHF = 0);
    always #(1e6 / 2 * (CLKHF_DIV == "0b11" ? 8 : 1) / 48) CLKHF = ~CLKHF & CLKHFPU & CLKHFEN;
endmodule

module OSC #(parameter FREQ_DIV = 0, DEVICE = "") (output reg OSCOUT = 0);
    always #(1e6 / 2 * FREQ_DIV / 250) OSCOUT = ~OSCOUT;
endmodule

module BUFG (input I, output O);
    assign O = I;
endmodule
"""
