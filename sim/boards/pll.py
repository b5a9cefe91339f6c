"""The PLLs of the parts: the clocks that they make from a board's oscillator, and their Verilog.

A clock is made exactly or not at all: every gain of an axis has its frequency in it. The ranges come from the vendors'
data sheets, cited in `docs/reference/boards.md`. Among several ways to make a clock, the fastest phase detector is
preferred, then the oscillator (VCO) nearest to the middle of its range.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import NamedTuple

from ...model.checks import FieldError

MHZ = 1_000_000
NEAREST = 4
"""The clocks that are named where the wanted one cannot be made."""


class ClockError(FieldError):
    """A board cannot make this clock; the one line of the message names the nearest possible clock."""


class Range(NamedTuple):
    """The lowest and the highest frequency of a part's data sheet, both included, Hz."""

    low: int
    high: int

    def __contains__(self, frequency: object) -> bool:
        return isinstance(frequency, int | Fraction) and self.low <= frequency <= self.high


class Setting(NamedTuple):
    """A way to make a clock; frequencies in Hz.

    Attributes:
        clock: the clock that is made.
        compared: the frequency at the phase detector.
        vco: the frequency of the PLL's own oscillator.
        dividers: the dividers that make it, by their names in `Pll`.
    """

    clock: Fraction
    compared: Fraction
    vco: Fraction
    dividers: tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class Pll(ABC):
    """A kind of PLL, with the ranges of its part.

    Attributes:
        compared: frequencies of the phase detector.
        vco: frequencies of its oscillator.
        clock: frequencies of its output.
    """

    compared: Range
    vco: Range
    clock: Range

    @abstractmethod
    def dividers(self, oscillator_hz: int) -> Iterator[Setting]:
        """Yield every combination of dividers, whether or not its frequencies are within their ranges."""

    @abstractmethod
    def cell(self, oscillator_hz: int, setting: Setting) -> str:
        """Return the Verilog of the cell: from the wire `pin`, it drives `clk` and `locked`."""

    def allows(self, setting: Setting) -> bool:
        """Return whether all frequencies of a setting are within their ranges."""
        return setting.compared in self.compared and setting.vco in self.vco and setting.clock in self.clock

    def best(self, oscillator_hz: int) -> dict[int, Setting]:
        """Return the clocks of whole hertz that an oscillator gives, and the best way to make each."""
        return _best(self, oscillator_hz)

    def setting(self, oscillator_hz: int, clock_hz: int) -> Setting:
        """Return the best way to make a clock.

        Raises:
            ClockError: if it cannot be made exactly; the nearest clocks that can are named.
        """
        made = self.best(oscillator_hz)
        if clock_hz not in made:
            near = sorted(sorted({*made, oscillator_hz}, key=lambda each: abs(each - clock_hz))[:NEAREST])
            raise ClockError(
                "clock_hz",
                f"must be one that the board makes exactly of its {oscillator_hz} Hz, nearest "
                f"{', '.join(map(str, near))}, not {clock_hz}",
            )
        return made[clock_hz]


@cache
def _best(pll: Pll, oscillator_hz: int) -> dict[int, Setting]:
    middle = Fraction(sum(pll.vco), 2)
    made: dict[int, Setting] = {}
    ranks: dict[int, tuple] = {}
    for setting in pll.dividers(oscillator_hz):
        if setting.clock.denominator == 1 and pll.allows(setting):
            clock, rank = int(setting.clock), (-setting.compared, abs(setting.vco - middle))
            if clock not in made or rank < ranks[clock]:
                made[clock], ranks[clock] = setting, rank
    return made


class Ehxplll(Pll):
    """The PLL of an ECP5, fed back from its output CLKOP, which runs at the phase detector's frequency.

    vco = oscillator / CLKI_DIV * CLKOP_DIV, and the clock, at the output CLKOS, is vco / CLKOS_DIV. With this feedback
    the output is any divisor of the VCO, rather than a multiple of the frequency that is compared.
    """

    MOST = 128
    """The largest of each divider."""

    def dividers(self, oscillator_hz: int) -> Iterator[Setting]:
        for clki in range(1, self.MOST + 1):
            compared = Fraction(oscillator_hz, clki)
            for clkop in range(1, self.MOST + 1):
                vco = compared * clkop
                if compared not in self.compared or vco not in self.vco:
                    continue
                for clkos in range(1, self.MOST + 1):
                    named = (("CLKI_DIV", clki), ("CLKFB_DIV", 1), ("CLKOP_DIV", clkop), ("CLKOS_DIV", clkos))
                    yield Setting(vco / clkos, compared, vco, named)

    def cell(self, oscillator_hz: int, setting: Setting) -> str:
        # An output without a shift has the phase of its divider less one.
        numbers = dict(setting.dividers)
        numbers |= {f"{name}_CPHASE": numbers[f"{name}_DIV"] - 1 for name in ("CLKOP", "CLKOS")}
        off = ("PLLRST_ENA", "INTFB_WAKE", "STDBY_ENABLE", "DPHASE_SOURCE")
        values = {
            **{"FEEDBK_PATH": '"CLKOP"', "CLKOP_ENABLE": '"ENABLED"', "CLKOS_ENABLE": '"ENABLED"'},
            **{"OUTDIVIDER_MUXA": '"DIVA"', "OUTDIVIDER_MUXB": '"DIVB"', **dict.fromkeys(off, '"DISABLED"')},
            **{**numbers, "CLKOP_FPHASE": 0, "CLKOS_FPHASE": 0},
        }
        ports = {
            **{"CLKI": "pin", "CLKFB": "feedback", "CLKOP": "feedback", "CLKOS": "clk", "LOCK": "locked"},
            **dict.fromkeys(("RST", "STDBY", "PHASESEL0", "PHASESEL1", "PLLWAKESYNC"), "1'b0"),
            # Its phase is never stepped.
            **dict.fromkeys(("PHASEDIR", "PHASESTEP", "PHASELOADREG"), "1'b1"),
            **dict.fromkeys(("ENCLKOP", "ENCLKOS", "ENCLKOS2", "ENCLKOS3"), "1'b0"),
            **dict.fromkeys(("CLKOS2", "CLKOS3", "INTLOCK", "REFCLK", "CLKINTFB"), ""),
        }
        # The loop filter that the vendor's tool gives every PLL of this range.
        filter_ = 'ICP_CURRENT="12", LPF_RESISTOR="8", MFG_ENABLE_FILTEROPAMP="1", MFG_GMCREF_SEL="2"'
        return f"    wire feedback;\n\n    (* {filter_} *)\n" + _instance("EHXPLLL", values, ports)


class SbPll40Pad(Pll):
    """The PLL of an iCE40 beside the pad of its reference: clock = oscillator (DIVF + 1) / (DIVR + 1) / 2**DIVQ.

    DIVF has the 64 values that the vendor documents.
    """

    FILTERS = 17 * MHZ, 26 * MHZ, 44 * MHZ, 66 * MHZ, 101 * MHZ
    """The phase detector's frequencies from which the next loop filter is taken; FILTER_RANGE counts from 1."""

    def dividers(self, oscillator_hz: int) -> Iterator[Setting]:
        for divr in range(16):
            for divf in range(64):
                compared = Fraction(oscillator_hz, divr + 1)
                vco = compared * (divf + 1)
                for divq in range(1, 7):
                    yield Setting(vco / 2**divq, compared, vco, (("DIVR", divr), ("DIVF", divf), ("DIVQ", divq)))

    def cell(self, oscillator_hz: int, setting: Setting) -> str:
        widths = {"DIVR": 4, "DIVF": 7, "DIVQ": 3}
        values = {"FEEDBACK_PATH": '"SIMPLE"', "PLLOUT_SELECT": '"GENCLK"'}
        values |= {name: f"{widths[name]}'b{number:0{widths[name]}b}" for name, number in setting.dividers}
        values["FILTER_RANGE"] = f"3'd{1 + sum(setting.compared >= limit for limit in self.FILTERS)}"
        ports = {"PACKAGEPIN": "pin", "PLLOUTGLOBAL": "clk", "LOCK": "locked", "RESETB": "1'b1", "BYPASS": "1'b0"}
        return _instance("SB_PLL40_PAD", values, ports)


class Rpll(Pll):
    """The PLL of a GW1NR: clock = oscillator (FBDIV_SEL + 1) / (IDIV_SEL + 1), and vco = clock ODIV_SEL."""

    OUTPUT = 2, 4, 8, 16, 32, 48, 64, 80, 96, 112, 128

    def dividers(self, oscillator_hz: int) -> Iterator[Setting]:
        for idiv in range(64):
            for fbdiv in range(64):
                compared = Fraction(oscillator_hz, idiv + 1)
                clock = compared * (fbdiv + 1)
                for odiv in self.OUTPUT:
                    named = (("IDIV_SEL", idiv), ("FBDIV_SEL", fbdiv), ("ODIV_SEL", odiv))
                    yield Setting(clock, compared, clock * odiv, named)

    def cell(self, oscillator_hz: int, setting: Setting) -> str:
        values = {"DEVICE": '"GW1NR-9C"', "FCLKIN": f'"{oscillator_hz / MHZ:g}"', **dict(setting.dividers)}
        values |= {f"DYN_{name}_SEL": '"false"' for name in ("IDIV", "FBDIV", "ODIV")}
        values["CLKFB_SEL"] = '"internal"'
        ports = {
            **{"CLKIN": "pin", "CLKOUT": "clk", "LOCK": "locked", "CLKFB": "1'b0", "RESET": "1'b0", "RESET_P": "1'b0"},
            **dict.fromkeys(("FBDSEL", "IDSEL", "ODSEL"), "6'b0"),
            **dict.fromkeys(("PSDA", "DUTYDA", "FDLY"), "4'b0"),
            **dict.fromkeys(("CLKOUTP", "CLKOUTD", "CLKOUTD3"), ""),
        }
        return _instance("rPLL", values, ports)


def _instance(cell: str, values: dict[str, object], ports: dict[str, str]) -> str:
    """Return the Verilog of a cell with its parameters and its ports; no wire at a port leaves it open."""
    with_values = ",\n".join(f"        .{name}({value})" for name, value in values.items())
    with_ports = ",\n".join(f"        .{name}({wire})" for name, wire in ports.items())
    return f"    {cell} #(\n{with_values}\n    ) pll (\n{with_ports}\n    );\n"
