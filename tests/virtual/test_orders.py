"""Orders to a virtual board: what each does, and one line for what is none."""

import re
from types import SimpleNamespace

import pytest

from hardwall.sim.rtl.board_library import SWITCHES, WIRES
from hardwall.sim.virtual.orders import ORDERS, OrderError, obey
from hardwall.sim.virtual.virtual_board import Hand
from support.pages import text_of


class Told:
    """A stand-in for a board and its line that keeps what it is told."""

    def __init__(self):
        self.told: list[tuple] = []
        self.hardware = SimpleNamespace(
            wire=lambda *words: self.told.append(words), switch=lambda *words: self.told.append(words)
        )
        self.hand, self.reversed, self.drops = Hand(0.0), False, 0
        self.scene = SimpleNamespace(spec=SimpleNamespace(travel_m=0.15))


@pytest.fixture
def told() -> Told:
    return Told()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        *((f"cut {wire}", (wire, "low")) for wire in WIRES),
        ("high a", ("a", "high")),
        ("invert b", ("b", "inverted")),
        ("mend  b_n ", ("b_n", "sound")),
        *((f"open {name}", (name, False)) for name in SWITCHES),
        ("close clock", ("clock", True)),
    ],
)
def test_wires_and_loops(told, text, expected):
    obey(told, told, text)
    assert told.told == [expected]


def test_the_hand_the_motor_and_the_line(told):
    for text in ("hold 4.5", "push -3", "motor swapped", "drop 7", "drop 2"):
        obey(told, told, text)
    assert (told.hand, told.reversed, told.drops) == (Hand(4.5e-3, -3.0), True, 9)
    for text in ("hold free", "motor right"):
        obey(told, told, text)
    assert (told.hand.held_m, told.reversed) == (None, False)


def test_the_page_has_every_order():
    rows = re.findall(r"^\| (`.*?) \|", text_of("docs/reference/virtual.md"), re.MULTILINE)
    assert {words.split()[0] for row in rows for words in re.findall("`(.*?)`", row)} == set(ORDERS)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("jump", f"the order must be one of {', '.join(ORDERS)}, not 'jump'"),
        ("", f"the order must be one of {', '.join(ORDERS)}, not ''"),
        ("cut", "the order must be `cut WIRE`, not 'cut'"),
        ("cut a b", "the order must be `cut WIRE`, not 'cut a b'"),
        ("cut z", "cut must be followed by one of a, b, a_n, b_n, not 'z'"),
        ("push nan", "push must be followed by -1000 to 1000 N, not 'nan'"),
        ("push 1e9", "push must be followed by -1000 to 1000 N, not '1e9'"),
        ("hold up", "hold must be followed by -150 to 150 mm, or free, not 'up'"),
        ("drop 0", "drop must be followed by 1 to 1e+06 bytes, not '0'"),
        ("motor left", "motor must be followed by one of swapped, right, not 'left'"),
    ],
)
def test_what_is_no_order_is_told_what_is(told, text, message):
    with pytest.raises(OrderError) as error:
        obey(told, told, text)
    assert str(error.value) == message
