"""The files of pins: every signal is placed once, where its board's description says, with its pull and 3.3 V."""

import re

import pytest

from hardwall.sim.boards.constraints import constraints, constraints_of
from hardwall.sim.boards.description import BOARDS
from hardwall.sim.boards.signals import OF_STAGE, signals_of, signals_of_axes

PLACED = {
    ".lpf": r'^LOCATE COMP "(\w+)" SITE "(\w+)";$',
    ".pcf": r"^set_io (?:-pullup yes )?(\w+) (\w+)$",
    ".cst": r'^IO_LOC "(\w+)" (\w+);$',
}
"""A signal and its pin, by the kind of file that says so."""
PULLED = {
    ".lpf": r'^IOBUF PORT "{}" IO_TYPE=LVCMOS33(?: PULLMODE=(\w+))?',
    ".cst": r'^IO_PORT "{}" IO_TYPE=LVCMOS33(?: PULL_MODE=(\w+))?',
}
"""The pull of a signal, and its level."""


@pytest.mark.parametrize("stage", OF_STAGE)
@pytest.mark.parametrize("board", BOARDS.values(), ids=BOARDS)
def test_every_signal_is_placed_once_with_its_pull(board, stage):
    text, suffix = constraints(board, stage), board.part.suffixes.pins
    placed = re.findall(PLACED[suffix], text, re.MULTILINE)
    assert placed == [(signal.name, board.pins[signal.name].site) for signal in signals_of(stage)]
    for signal in signals_of(stage):
        pull = board.pins[signal.name].pull
        if suffix == ".pcf":
            assert (f"set_io -pullup yes {signal.name} " in text) == (pull == "up")
            assert pull != "down", "the part has none"
        else:
            (said,) = re.findall(PULLED[suffix].format(signal.name), text, re.MULTILINE)
            assert (said or "NONE").lower() == pull


def test_every_signal_of_several_axes_is_placed_once():
    board, signals = BOARDS["ulx3s-25f"].of_axes(8), signals_of_axes(8)
    placed = re.findall(PLACED[".lpf"], constraints_of(board, signals), re.MULTILINE)
    assert placed == [(signal.name, board.pins[signal.name].site) for signal in signals]


@pytest.mark.parametrize("stage", OF_STAGE)
@pytest.mark.parametrize("name", ["ulx3s-25f", "tangnano9k"])
def test_outputs_are_weak(name, stage):
    lines = constraints(BOARDS[name], stage).splitlines()
    strong = {line.split('"')[1] for line in lines if "DRIVE=4" in line}
    assert strong == {signal.name for signal in signals_of(stage) if signal.out}
