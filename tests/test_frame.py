"""Frames of the serial port: places, lengths and both conversions, on a frame made by hand and on the board's own."""

import pytest
from amaranth.hdl import Shape, signed, unsigned

from hardwall.hdl.board import Board
from hardwall.hdl.frame import Frame, Place
from stimuli.specs import spec

FIELDS = {"start": unsigned(1), "count": signed(5), "level": unsigned(3), "last": signed(2)}
FRAME = Frame(FIELDS, 16)
# start 1, count -3, level 5, last -2, and five unused bits, the first on the wire at the left.
BITS = "1111011011000000"
VALUES = {"start": 1, "count": -3, "level": 5, "last": -2}


def test_the_first_field_is_on_top():
    assert list(FRAME) == [
        Place("start", 15, Shape(1)),
        Place("count", 10, Shape(5, True)),
        Place("level", 7, Shape(3)),
        Place("last", 5, Shape(2, True)),
    ]
    assert FRAME.unused == 5


def test_values_go_to_the_wire_and_come_back():
    assert FRAME.encode(VALUES) == int(BITS, 2).to_bytes(2, "big")
    assert FRAME.decode(FRAME.encode(VALUES)) == VALUES


def test_a_field_without_a_value_is_zero():
    assert FRAME.encode({}) == bytes(2)
    assert FRAME.encode({"level": 7}) == (7 << 7).to_bytes(2, "big")


@pytest.mark.parametrize("name", FIELDS)
def test_both_ends_of_every_field_come_back_and_nothing_beyond_fits(name):
    shape = FIELDS[name]
    least = -(1 << (shape.width - 1)) if shape.signed else 0
    most = least + (1 << shape.width) - 1
    others = dict.fromkeys(FIELDS, 0)
    for value in (least, most):
        assert FRAME.decode(FRAME.encode({name: value})) == others | {name: value}
    for value in (least - 1, most + 1):
        with pytest.raises(ValueError, match=rf"^{name} must be {least} to {most}, not {value}$"):
            FRAME.encode({name: value})


def test_what_is_unused_is_not_read():
    assert FRAME.decode(b"\x00\x1f") == dict.fromkeys(FIELDS, 0)


def test_a_field_that_is_none_is_refused():
    with pytest.raises(ValueError, match=r"^name must be one of start, count, level, last, not 'stop'$"):
        FRAME.encode({"stop": 1})


@pytest.mark.parametrize("length", [0, 1, 3])
def test_another_length_is_refused(length):
    with pytest.raises(ValueError, match=rf"^frame must have 2 bytes, not {length}$"):
        FRAME.decode(bytes(length))


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow", "wide"])
def test_the_boards_frames_are_the_fewest_whole_bytes(name):
    board = Board(spec(name))
    frames = board.commands, board.telemetry
    assert {frame.bits for frame in frames} == {board.frame_bits}
    assert board.frame_bits % 8 == 0
    # The last bit is none of a field, and there is no whole byte too many.
    assert 1 <= min(frame.unused for frame in frames) <= 8
