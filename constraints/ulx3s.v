// ULX3S, PCB v2.x.x and v3.0.x: the clock of `board` is 50000000 Hz, its drive pdm. The clock is made of 25000000 Hz by CLKI_DIV 1, CLKFB_DIV 1, CLKOP_DIV 24, CLKOS_DIV 12; VCO 600 MHz.
// Generated; the pins are in the file of constraints beside it, and what to connect to them in WIRING.md.

module top (
    input clk,
    input rst,
    input encoder_a,
    input encoder_a_n,
    input encoder_b,
    input encoder_b_n,
    input encoder_z,
    input drive_enable,
    input external_fault,
    input emergency_stop,
    output drive_pdm,
    output drive_sign,
    output alive,
    input uart_rx,
    output uart_tx
);
    wire clock, locked, oscillator, outputs_enable, pdm, sign, pump;

    board_clock board_clock (.pin(clk), .clk(clock), .locked(locked));
    internal_oscillator internal_oscillator (.oscillator(oscillator));

    // A clock that is not locked is a reset.
    board board (
        .clk(clock),
        .rst(rst | ~locked),
        .encoder_a(encoder_a),
        .encoder_a_n(encoder_a_n),
        .encoder_b(encoder_b),
        .encoder_b_n(encoder_b_n),
        .encoder_z(encoder_z),
        .drive_enable(drive_enable),
        .external_fault(external_fault),
        .emergency_stop(emergency_stop),
        .drive_pdm(pdm),
        .drive_sign(sign),
        .alive(pump),
        .uart_rx(uart_rx),
        .uart_tx(uart_tx),
        .oscillator(oscillator),
        .outputs_enable(outputs_enable)
    );

    // Until the PLL has locked, both clocks run and the reset has ended, the pull-downs outside hold these.
    wire driven = outputs_enable & locked;
    assign drive_pdm = driven ? pdm : 1'bz;
    assign drive_sign = driven ? sign : 1'bz;
    assign alive = driven ? pump : 1'bz;
endmodule

module board_clock (input pin, output clk, output locked);
    wire feedback;

    (* ICP_CURRENT="12", LPF_RESISTOR="8", MFG_ENABLE_FILTEROPAMP="1", MFG_GMCREF_SEL="2" *)
    EHXPLLL #(
        .FEEDBK_PATH("CLKOP"),
        .CLKOP_ENABLE("ENABLED"),
        .CLKOS_ENABLE("ENABLED"),
        .OUTDIVIDER_MUXA("DIVA"),
        .OUTDIVIDER_MUXB("DIVB"),
        .PLLRST_ENA("DISABLED"),
        .INTFB_WAKE("DISABLED"),
        .STDBY_ENABLE("DISABLED"),
        .DPHASE_SOURCE("DISABLED"),
        .CLKI_DIV(1),
        .CLKFB_DIV(1),
        .CLKOP_DIV(24),
        .CLKOS_DIV(12),
        .CLKOP_CPHASE(23),
        .CLKOS_CPHASE(11),
        .CLKOP_FPHASE(0),
        .CLKOS_FPHASE(0)
    ) pll (
        .CLKI(pin),
        .CLKFB(feedback),
        .CLKOP(feedback),
        .CLKOS(clk),
        .LOCK(locked),
        .RST(1'b0),
        .STDBY(1'b0),
        .PHASESEL0(1'b0),
        .PHASESEL1(1'b0),
        .PLLWAKESYNC(1'b0),
        .PHASEDIR(1'b1),
        .PHASESTEP(1'b1),
        .PHASELOADREG(1'b1),
        .ENCLKOP(1'b0),
        .ENCLKOS(1'b0),
        .ENCLKOS2(1'b0),
        .ENCLKOS3(1'b0),
        .CLKOS2(),
        .CLKOS3(),
        .INTLOCK(),
        .REFCLK(),
        .CLKINTFB()
    );
endmodule

module internal_oscillator (output oscillator);
    OSCG #(.DIV(128)) internal (.OSC(oscillator));
endmodule
