"""Simulation models of cells without one in Yosys: multipliers and block memories, in the mapped modes.

A model ends the simulation if its cell is used otherwise: with a register, a reset, or ports of two widths. The ports
and the places of a memory's bits are as in Yosys's own techmaps. The tests compare each model with the Verilog of a
product and of memories.

What a data sheet leaves open is as bad as can be. A memory's output is anything at power-up, and where a port reads
what the other port writes at the same edge, it reads random bits.
"""

SLICES = 64
"""Parameters that hold the first content of a block memory."""
ROWS = 16
"""Rows in each of these; a row is two bytes of 9 bits."""


def _bits(name: str, width: int) -> str:
    """Return the names of the bits of a word that are ports of their own, the most significant first."""
    return ", ".join(f"{name}{bit}" for bit in reversed(range(width)))


def _multiplier(width: int, a: str, b: str, signs: tuple[str, str], product: str) -> str:
    """Return the assignment of a product: modulo twice the width it equals the product of the extended operands."""
    extended = (
        f"{{{{{width}{{{word}[{width - 1}] & {sign}}}}}, {word}}}" for word, sign in zip((a, b), signs, strict=True)
    )
    return f"assign {product} = {' * '.join(extended)};"


def _gowin_multiplier(width: int) -> str:
    registers = ("AREG", "BREG", "OUT_REG", "PIPE_REG", "ASIGN_REG", "BSIGN_REG", "SOA_REG")
    return f"""
module MULT{width}X{width}(
    input [{width - 1}:0] A, B, SIA, SIB, input ASIGN, BSIGN, ASEL, BSEL, CE, CLK, RESET,
    output [{2 * width - 1}:0] DOUT
);
  parameter {", ".join(f"{name} = 1'b0" for name in registers)};
  {_multiplier(width, "A", "B", ("ASIGN", "BSIGN"), "DOUT")}
  initial if ({" | ".join(registers)}) $fatal(1, "a multiplier has a register");
  always @* if (ASEL | BSEL) $fatal(1, "a multiplier has a shifted operand");
endmodule
"""


def _ecp5_multiplier() -> str:
    registers = ("INPUTA", "INPUTB", "INPUTC", "PIPELINE", "OUTPUT")
    used = " || ".join(f'REG_{name}_CLK != "NONE"' for name in registers)
    return f"""
module MULT18X18D(
    input {_bits("A", 18)},
    input {_bits("B", 18)},
    input {_bits("C", 18)},
    input SIGNEDA, SIGNEDB, SOURCEA, SOURCEB,
    output {_bits("P", 36)}
);
  parameter {", ".join(f'REG_{name}_CLK = "NONE"' for name in registers)};
  wire [17:0] a = {{{_bits("A", 18)}}}, b = {{{_bits("B", 18)}}};
  wire [35:0] product;
  {_multiplier(18, "a", "b", ("SIGNEDA", "SIGNEDB"), "product")}
  assign {{{_bits("P", 36)}}} = product;
  initial if ({used}) $fatal(1, "a multiplier has a register");
  always @* if (SOURCEA | SOURCEB) $fatal(1, "a multiplier has a shifted operand");
endmodule
"""


def _memory(slices: str, stride: int) -> str:
    """Return the parameters of the first content, with rows `stride` bits apart, and the memory with it."""
    names = [f"{slices}{number:02X}" for number in range(SLICES)]
    filled = "\n".join(
        f"    for (i = 0; i < {ROWS}; i = i + 1) "
        f"{{bytes[{2 * ROWS * number} + 2*i + 1], bytes[{2 * ROWS * number} + 2*i]}} = {name}[{stride}*i +: 18];"
        for number, name in enumerate(names)
    )
    zeros = ", ".join(f"{name} = {ROWS * stride}'b0" for name in names)
    return f"""
  parameter [{ROWS * stride - 1}:0] {zeros};
  reg [8:0] bytes [0:{2 * ROWS * SLICES - 1}];
  integer i;
  initial begin
{filled}
  end
"""


def _port(port: str, other: str, width: str, mode: str) -> str:
    """Return one of two ports that share a width, 9 or 18 bits; at 18, the lowest bits of the address enable bytes.

    The mode is the port's own reading where it writes: the `OLD` word, the `NEW` one, or it `KEEP`s its last reading.
    """
    p, o = port, other
    return f"""
  wire [1:0] write_{p} = {{2{{en_{p} & we_{p}}}}} & ({width} == 18 ? address_{p}[1:0] : 2'b01);
  wire [10:0] place_{p} = {width} == 18 ? {{address_{p}[13:4], 1'b0}} : address_{p}[13:3];
  wire [17:0] stored_{p} = {{{width} == 18 ? bytes[place_{p} | 1] : 9'b0, bytes[place_{p}]}};
  wire [17:0] written_{p} = {{write_{p}[1] ? data_{p}[17:9] : stored_{p}[17:9],
                             write_{p}[0] ? data_{p}[8:0] : stored_{p}[8:0]}};
  always @(posedge clk_{p}) if (en_{p}) begin
    if (write_{p}[0]) bytes[place_{p}] <= data_{p}[8:0];
    if (write_{p}[1]) bytes[place_{p} | 1] <= data_{p}[17:9];
    if (write_{o} != 0 && place_{p} == place_{o}) read_{p} <= 18'($urandom);
    else if (write_{p} == 0 || {mode} == "OLD") read_{p} <= stored_{p};
    else if ({mode} == "NEW") read_{p} <= written_{p};
  end
"""


def _wide(data: str, read: str) -> str:
    """Return the ports of a memory of 36 bits: A writes, with an enable for each byte in its address, and B reads."""
    return f"""
  wire [3:0] write = {{4{{en_A & we_A}}}} & address_A[3:0];
  wire [10:0] place = {{address_A[13:5], 2'b0}}, stored = {{address_B[13:5], 2'b0}};
  integer part;
  always @(posedge clk_A)
    for (part = 0; part < 4; part = part + 1) if (write[part]) bytes[place + 11'(part)] <= {data}[9*part +: 9];
  always @(posedge clk_B) if (en_B)
    if (write != 0 && place == stored) {read} <= 36'({{$urandom, $urandom}});
    else {read} <= {{bytes[stored + 3], bytes[stored + 2], bytes[stored + 1], bytes[stored]}};
"""


def _narrow(data: str, width: int) -> str:
    """Return a memory of single bits with one port, A, that reads only where it does not write; it has no content.

    What it reads is the lowest of so many bits as `width` says.
    """
    return f"""
  reg cells [0:16383];
  always @(posedge clk_A) if (en_A) begin
    if (we_A) cells[address_A] <= {data};
    else read_A <= {width}'(cells[address_A]);
  end
"""


def _ecp5_memory() -> str:
    def port(p: str) -> str:
        data, address = _bits(f"DI{p}", 18), _bits(f"AD{p}", 14)
        return (
            f"    input {data},\n    input {address},\n    input CE{p}, OCE{p}, CLK{p}, WE{p}, RST{p},\n"
            f"    input CS{p}2, CS{p}1, CS{p}0,\n    output {_bits(f'DO{p}', 18)}"
        )

    def wires(p: str) -> str:
        return f"""
  wire clk_{p} = CLK{p}, en_{p} = CE{p}, we_{p} = WE{p};
  wire [13:0] address_{p} = {{{_bits(f"AD{p}", 14)}}};
  wire [17:0] data_{p} = {{{_bits(f"DI{p}", 18)}}};
  reg [17:0] read_{p};
  assign {{{_bits(f"DO{p}", 18)}}} = read_{p};
  localparam MODE_{p} = WRITEMODE_{p} == "READBEFOREWRITE" ? "OLD" : WRITEMODE_{p} == "WRITETHROUGH" ? "NEW" : "KEEP";
  parameter REGMODE_{p} = "NOREG", CSDECODE_{p} = "0b000", CLK{p}MUX = "CLK{p}";
  initial if (REGMODE_{p} != "NOREG" || CLK{p}MUX != "CLK{p}") $fatal(1, "a memory has an output register");
  always @* if (RST{p} || CS{p}2 || CS{p}1 || CS{p}0) $fatal(1, "a memory is reset or not selected");
"""

    return f"""
module DP16KD(
{port("A")},
{port("B")}
);
  parameter DATA_WIDTH_A = 18, DATA_WIDTH_B = 18, WRITEMODE_A = "NORMAL", WRITEMODE_B = "NORMAL";
  parameter RESETMODE = "SYNC", ASYNC_RESET_RELEASE = "SYNC", GSR = "ENABLED";
  initial if (DATA_WIDTH_A == 1 ? WRITEMODE_A != "NORMAL" :
              DATA_WIDTH_A != DATA_WIDTH_B || (DATA_WIDTH_A != 36 && DATA_WIDTH_A != 18 && DATA_WIDTH_A != 9))
    $fatal(1, "a memory's widths");
{wires("A")}{wires("B")}{_memory("INITVAL_", 20)}
  wire [35:0] data = {{data_B, data_A}};
  generate if (DATA_WIDTH_A == 36) begin : wide
{_wide("data", "{read_B, read_A}")}
  end else if (DATA_WIDTH_A == 1) begin : bits
{_narrow("data_A[0]", 18)}
  initial read_B = 18'($urandom);
  always @* if (en_B) $fatal(1, "a memory of bits has a second port");
  end else begin : ports
{_port("A", "B", "DATA_WIDTH_A", "MODE_A")}{_port("B", "A", "DATA_WIDTH_A", "MODE_B")}
  end endgenerate
endmodule
"""


def _gowin_modes(number: str, port: str) -> str:
    chosen = f'WRITE_MODE{number} == 2 ? "OLD" : WRITE_MODE{number} == 1 ? "NEW" : "KEEP"'
    return f"localparam MODE_{port} = {chosen};"


def _gowin_two_ports() -> str:
    """Return the memory with two ports of a width."""

    def wires(p: str, number: str) -> str:
        return f"""
  wire clk_{p} = CLK{p}, en_{p} = CE{p}, we_{p} = WRE{p};
  wire [13:0] address_{p} = AD{p};
  wire [17:0] data_{p} = DI{p};
  reg [17:0] read_{p};
  assign DO{p} = read_{p};
  {_gowin_modes(number, p)}
  always @* if (RESET{p} || BLKSEL{p} != 0) $fatal(1, "a memory is reset or not selected");
"""

    return f"""
module DPX9B(
    input CLKA, CEA, CLKB, CEB, OCEA, OCEB, RESETA, RESETB, WREA, WREB,
    input [13:0] ADA, ADB, input [17:0] DIA, DIB, input [2:0] BLKSELA, BLKSELB, output [17:0] DOA, DOB
);
  parameter READ_MODE0 = 1'b0, READ_MODE1 = 1'b0, BLK_SEL_0 = 3'b000, BLK_SEL_1 = 3'b000, RESET_MODE = "SYNC";
  parameter BIT_WIDTH_0 = 18, BIT_WIDTH_1 = 18, WRITE_MODE0 = 0, WRITE_MODE1 = 0;
  initial if (BIT_WIDTH_0 != BIT_WIDTH_1 || (BIT_WIDTH_0 != 18 && BIT_WIDTH_0 != 9)) $fatal(1, "a memory's widths");
  initial if (READ_MODE0 | READ_MODE1) $fatal(1, "a memory has an output register");
{wires("A", "0")}{wires("B", "1")}{_memory("INIT_RAM_", 18)}
{_port("A", "B", "BIT_WIDTH_0", "MODE_A")}{_port("B", "A", "BIT_WIDTH_0", "MODE_B")}
endmodule
"""


def _gowin_one_port() -> str:
    """Return the memories with one port."""
    return f"""
module SPX9(
    input CLK, CE, OCE, RESET, WRE, input [13:0] AD, input [35:0] DI, input [2:0] BLKSEL, output [35:0] DO
);
  parameter READ_MODE = 1'b0, BLK_SEL = 3'b000, RESET_MODE = "SYNC", BIT_WIDTH = 36, WRITE_MODE = 0;
  initial if (BIT_WIDTH != 18 && BIT_WIDTH != 9) $fatal(1, "a memory's width");
  initial if (READ_MODE) $fatal(1, "a memory has an output register");
  wire clk_A = CLK, en_A = CE, we_A = WRE;
  wire [1:0] write_B = 0;
  wire [10:0] place_B = 0;
  wire [13:0] address_A = AD;
  wire [17:0] data_A = DI[17:0];
  reg [17:0] read_A;
  assign DO = {{18'b0, read_A}};
  {_gowin_modes("", "A")}
  always @* if (RESET || BLKSEL != 0) $fatal(1, "a memory is reset or not selected");
{_memory("INIT_RAM_", 18)}{_port("A", "B", "BIT_WIDTH", "MODE_A")}
endmodule

module SP(
    input CLK, CE, OCE, RESET, WRE, input [13:0] AD, input [31:0] DI, input [2:0] BLKSEL, output [31:0] DO
);
  parameter READ_MODE = 1'b0, BLK_SEL = 3'b000, RESET_MODE = "SYNC", BIT_WIDTH = 32, WRITE_MODE = 0;
  parameter [255:0] {", ".join(f"INIT_RAM_{number:02X} = 0" for number in range(SLICES))};
  initial if (BIT_WIDTH != 1 || WRITE_MODE != 0) $fatal(1, "a memory's width");
  initial if (READ_MODE) $fatal(1, "a memory has an output register");
  wire clk_A = CLK, en_A = CE, we_A = WRE;
  wire [13:0] address_A = AD;
  reg [0:0] read_A;
  assign DO = {{31'b0, read_A}};
  always @* if (RESET || BLKSEL != 0) $fatal(1, "a memory is reset or not selected");
{_narrow("DI[0]", 1)}
endmodule
"""


def _gowin_wide() -> str:
    """Return the memory of 36 bits."""
    return f"""
module SDPX9B(
    input CLKA, CEA, CLKB, CEB, OCE, RESETA, RESETB, input [13:0] ADA, ADB, input [35:0] DI,
    input [2:0] BLKSELA, BLKSELB, output [35:0] DO
);
  parameter READ_MODE = 1'b0, BLK_SEL_0 = 3'b000, BLK_SEL_1 = 3'b000, RESET_MODE = "SYNC";
  parameter BIT_WIDTH_0 = 36, BIT_WIDTH_1 = 36;
  initial if (BIT_WIDTH_0 != 36 || BIT_WIDTH_1 != 36) $fatal(1, "a memory's widths");
  initial if (READ_MODE) $fatal(1, "a memory has an output register");
  always @* if (RESETA || RESETB || BLKSELA != 0 || BLKSELB != 0) $fatal(1, "a memory is reset or not selected");
{_memory("INIT_RAM_", 18)}
  wire clk_A = CLKA, en_A = CEA, we_A = 1, clk_B = CLKB, en_B = CEB;
  wire [13:0] address_A = ADA, address_B = ADB;
  reg [35:0] read;
  assign DO = read;
{_wide("DI", "read")}
endmodule
"""


ECP5 = _ecp5_multiplier() + _ecp5_memory()
GOWIN = _gowin_multiplier(9) + _gowin_multiplier(18) + _gowin_two_ports() + _gowin_one_port() + _gowin_wide()
