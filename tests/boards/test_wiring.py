"""The page on the wiring of a board: every signal with its pins, its pull-down, and the serial port."""

import pytest

from hardwall.hdl.axis.board import Board
from hardwall.sim.boards.description import BOARDS
from hardwall.sim.boards.signals import signals_of
from hardwall.sim.boards.top import INSIDE
from hardwall.sim.boards.wiring import table, wiring
from stimuli.specs import spec
from stimuli.stages import axis

ONE_OF_EACH = ["pdm", "pwm", "dac"]


@pytest.mark.parametrize("stage", ONE_OF_EACH)
@pytest.mark.parametrize("board", BOARDS.values(), ids=BOARDS)
def test_every_port_of_the_board_is_in_the_table(board, stage):
    lines = table(board, stage).splitlines()
    heads, _, *rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    found = {row[0].strip("`"): dict(zip(heads, row, strict=True)) for row in rows}
    ports = Board(axis(stage)).signature.members
    assert set(found) == set(ports) - INSIDE
    for signal in signals_of(stage):
        row, pin = found[signal.name], board.pins[signal.name]
        assert (row["where"], row["FPGA pin"]) == (pin.at, pin.site)
        assert row["direction"] == ports[signal.name].flow.name.lower()
        assert row["outside"] == signal.outside
        assert all((row["what it is"], row["at rest"]))


@pytest.mark.parametrize("board", BOARDS.values(), ids=BOARDS)
def test_the_page_says_what_must_be_known_first(board):
    text = wiring(board, spec("mhz"), "picture.svg")
    for said in ("not tried on real hardware", "](picture.svg)", "3.3 V", "AM26LV32", board.serial.by_id, board.title):
        assert said in text
    for note in (*board.notes, *board.sources, board.power_up):
        assert note in text


def test_the_banks_of_1_8_volts_are_named():
    assert "**Bank 3 has 1.8 V**" in wiring(BOARDS["tangnano9k"], spec("mhz"), "picture.svg")


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("pdm", ["drive_pdm is low", "without a pause are 65.536 N.", "A step is 0.001 N."]),
        ("pdm scaled", ["without a pause are 64 N.", "6.4 N/V at the handle and 10 V"]),
        (
            "pwm",
            ["all four gates are low", "at 200000 Hz", "5 clocks, 100 ns", "48 N, of which at most 45.12 N are made"],
        ),
        ("pwm narrow", ["inverted: `drive_invert` is 1 after a reset", "1 N/A at the handle"]),
        ("dac", ["dac_clear_n is low", "24 bits at 25 MHz in mode 1, 50 clocks each", "2 frames of setup", "is 40 N."]),
        ("dac bare", ["no force at -0.3 A: at safe pins 2.7 N are left", "45 N"]),
    ],
)
def test_the_page_says_what_the_drive_is(name, said):
    text = wiring(BOARDS["icebreaker"], axis(name), "picture.svg")
    for each in (*said, "after 1 clock.", "through a gate alone"):
        assert each in text
