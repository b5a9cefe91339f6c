// Tang Nano 9K: the clock of `board` is 27000000 Hz, its drive pdm. The clock is the oscillator's own.
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
    assign clk = pin;
    assign locked = 1'b1;
endmodule

module internal_oscillator (output oscillator);
    wire divided;

    OSC #(.FREQ_DIV(40), .DEVICE("GW1NR-9C")) internal (.OSCOUT(divided));
    BUFG buffer (.I(divided), .O(oscillator));
endmodule
