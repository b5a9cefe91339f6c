// What is around `board` on a part: its internal oscillator, which a file of its board has, and the pads of the drive.

module top (
    input  clk, rst,
    input  encoder_a, encoder_b, encoder_z, encoder_a_n, encoder_b_n,
    input  drive_enable, external_fault, emergency_stop,
    input  uart_rx,
    output uart_tx,
    output drive_pdm, drive_sign, alive
);
    wire oscillator, outputs_enable, pdm, sign, pump;

    internal_oscillator internal_oscillator (.clk(oscillator));

    board board (
        .clk(clk), .rst(rst), .oscillator(oscillator),
        .encoder_a(encoder_a), .encoder_b(encoder_b), .encoder_z(encoder_z),
        .encoder_a_n(encoder_a_n), .encoder_b_n(encoder_b_n),
        .drive_enable(drive_enable), .external_fault(external_fault), .emergency_stop(emergency_stop),
        .uart_rx(uart_rx), .uart_tx(uart_tx),
        .drive_pdm(pdm), .drive_sign(sign), .alive(pump), .outputs_enable(outputs_enable)
    );

    // Until both clocks run and the reset has ended, the pull-downs outside hold these.
    assign drive_pdm = outputs_enable ? pdm : 1'bz;
    assign drive_sign = outputs_enable ? sign : 1'bz;
    assign alive = outputs_enable ? pump : 1'bz;
endmodule
