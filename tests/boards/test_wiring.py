"""The page on the wiring of a board: every signal with its pins, its pull-down, and the serial port."""

import pytest

from hardwall.hdl.board import Board
from hardwall.sim.boards.description import BOARDS
from hardwall.sim.boards.signals import SIGNALS
from hardwall.sim.boards.top import INSIDE
from hardwall.sim.boards.wiring import table, wiring
from stimuli.specs import spec


@pytest.mark.parametrize("board", BOARDS.values(), ids=BOARDS)
def test_every_port_of_the_board_is_in_the_table(board):
    heads, _, *rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table(board).splitlines()]
    found = {row[0].strip("`"): dict(zip(heads, row, strict=True)) for row in rows}
    ports = Board(spec("mhz")).signature.members
    assert set(found) == set(ports) - INSIDE
    for signal in SIGNALS:
        row, pin = found[signal.name], board.pins[signal.name]
        assert (row["where"], row["FPGA pin"]) == (pin.at, pin.site)
        assert row["direction"] == ports[signal.name].flow.name.lower()
        assert (row["outside"] == "1 kΩ to ground") == signal.pulled_down
        assert all((row["what it is"], row["at rest"]))


@pytest.mark.parametrize("board", BOARDS.values(), ids=BOARDS)
def test_the_page_says_what_must_be_known_first(board):
    text = wiring(board, "picture.svg")
    for said in ("not tried on real hardware", "](picture.svg)", "3.3 V", "AM26LV32", board.serial.by_id, board.title):
        assert said in text
    for note in (*board.notes, *board.sources, board.power_up):
        assert note in text


def test_the_banks_of_1_8_volts_are_named():
    assert "**Bank 3 has 1.8 V**" in wiring(BOARDS["tangnano9k"], "picture.svg")
