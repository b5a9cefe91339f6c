"""The picture of the headers: SVG in which every signal on a header stands once, at its position."""

from collections import Counter
from xml.etree import ElementTree

import pytest

from hardwall.sim.boards.description import BOARDS
from hardwall.sim.boards.picture import HIGH, WIDE, picture
from hardwall.sim.boards.signals import OF_STAGE, signals_of

SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.parametrize("stage", OF_STAGE)
@pytest.mark.parametrize("board", BOARDS.values(), ids=BOARDS)
def test_every_signal_on_a_header_stands_once_below_its_position(board, stage):
    root = ElementTree.fromstring(picture(board, stage))
    labels = [(float(each.get("x")), float(each.get("y")), each.text) for each in root.findall(f"{SVG}text")]
    signals = [(float(each.get("x")), float(each.get("y")), each.text) for each in root.iterfind(f"{SVG}g/{SVG}text")]
    names = {header.name for header in board.headers}
    pins = {signal.name: board.pins[signal.name] for signal in signals_of(stage)}
    expected = {f"{name} ({pin.site})": pin for name, pin in pins.items() if pin.at.split()[0] in names}
    assert Counter(text for *_, text in signals) == Counter(list(expected))
    for x, y, text in signals:
        over = {label for left, top, label in labels if abs(left - x) < WIDE / 2 and 0 < y - top < HIGH}
        assert expected[text].at.partition(" ")[2] in over


@pytest.mark.parametrize("board", BOARDS.values(), ids=BOARDS)
def test_all_is_inside_the_picture(board):
    root = ElementTree.fromstring(picture(board))
    _, _, width, height = map(float, root.get("viewBox").split())
    for box in root.findall(f"{SVG}rect")[1:]:
        assert 0 < float(box.get("x")) < float(box.get("x")) + float(box.get("width")) < width
        assert 0 < float(box.get("y")) < float(box.get("y")) + float(box.get("height")) < height
