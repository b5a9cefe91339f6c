"""Tables of ports and frames, as exact text; `test_export` holds the ports against the Verilog."""

import pytest
from amaranth.hdl import signed, unsigned

from hardwall.hdl.axis import Axis
from hardwall.hdl.board import Board
from hardwall.hdl.frame import Frame
from hardwall.hdl.ports import frame_table, port_table
from stimuli.specs import spec

FRAME = Frame({"start": unsigned(1), "count": signed(5), "level": unsigned(3), "last": signed(2)}, 16)
TABLE = """\
| bits | field | read as |
| --- | --- | --- |
| 15 | `start` | unsigned |
| 14:10 | `count` | signed |
| 9:7 | `level` | unsigned |
| 6:5 | `last` | signed |
"""


def test_a_table_of_a_frame_is_exact():
    assert frame_table(FRAME) == TABLE + "| 4:0 |  | unused |\n"


def test_a_full_frame_has_no_unused_bits():
    bits = [line.split()[1] for line in frame_table(Frame(FRAME.fields, 11)).splitlines()[2:]]
    assert bits == ["10", "9:5", "4:2", "1:0"]


@pytest.mark.parametrize("direction", ["commands", "telemetry"])
def test_a_table_of_the_board_has_the_places_of_its_frame(direction):
    frame = getattr(Board(spec("mhz")), direction)
    lines = frame_table(frame).splitlines()[2:]
    for line, (name, low, shape) in zip(lines, frame, strict=False):
        bits = f"{low + shape.width - 1}:{low}" if shape.width > 1 else f"{low}"
        assert line == f"| {bits} | `{name}` | {'signed' if shape.signed else 'unsigned'} |"
    assert len(lines) == len(frame.fields) + bool(frame.unused)


def test_a_row_of_every_kind_is_exact():
    lines = port_table(Axis(spec("mhz"))).splitlines()
    assert lines[0] == "| port | direction | width | format | one LSB | range | reset | what it is |"
    for line in (
        "| `clk` | in | 1 | bit |  |  |  | clock; everything is done at its rise |",
        "| `encoder_invert` | in | 1 | UQ(1, 0) |  | 0 to 1 | 0 | 1: count the other way |",
        "| `wall_stiffness` | in | 16 | UQ(8, 8) | 3.90625 N/m | 0 to 255996 N/m | 0 | spring of the wall |",
        "| `count` | out | 21 | SQ(21, 0) | 1e-06 m | -1.04858 to 1.04858 m |  | position, live |",
        "| `stamp` | out | 26 | UQ(26, 0) | 2e-08 s | 0 to 1.34218 s |  | number of this clock |",
    ):
        assert line in lines
