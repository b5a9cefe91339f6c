`ifndef ROUNDING_VH
`define ROUNDING_VH
// Divides a signed value by 2**BITS, rounded down.
`define ROUNDED_DOWN(VALUE, BITS) ((VALUE) >>> (BITS))
`endif
