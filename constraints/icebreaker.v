// iCEBreaker v1.0e: the clock of `board` is 24000000 Hz, its drive pdm. The clock is made of 12000000 Hz by DIVR 0, DIVF 63, DIVQ 5; VCO 768 MHz.
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
    SB_PLL40_PAD #(
        .FEEDBACK_PATH("SIMPLE"),
        .PLLOUT_SELECT("GENCLK"),
        .DIVR(4'b0000),
        .DIVF(7'b0111111),
        .DIVQ(3'b101),
        .FILTER_RANGE(3'd1)
    ) pll (
        .PACKAGEPIN(pin),
        .PLLOUTGLOBAL(clk),
        .LOCK(locked),
        .RESETB(1'b1),
        .BYPASS(1'b0)
    );
endmodule

module internal_oscillator (output oscillator);
    SB_HFOSC #(.CLKHF_DIV("0b11")) internal (.CLKHFPU(1'b1), .CLKHFEN(1'b1), .CLKHF(oscillator));
endmodule
