"""Homing a handle that never rests: the index is exactly where it is said to be, or homing says that it is lost."""

from types import SimpleNamespace

import numpy as np
import pytest

from hardwall.host.errors import NotReadyError
from hardwall.host.homing import INDEX, homing
from hardwall.host.status import State
from hardwall.model.encoder import quadrature
from hardwall.model.encoder.quadrature import NO_STROBES, START, Inputs, Params, Strobes
from hardwall.testing import rng
from stimuli.supervised import supervised

REGISTERS = supervised("mhz")
COUNT = REGISTERS["count"]
INDEX_AT = 37
"""The edge at which Z rises upwards; it is three counts wide."""


class Trembling:
    """A decoder whose handle goes over its index and trembles by a count from then on, seen as an axis is.

    Args:
        random: of the clocks that pass between two requests.
        goes: the counts that the handle goes before it trembles.
        slips: whether the scale slips once the index is found.
        origin: the count at first.
    """

    def __init__(self, random: np.random.Generator, goes: int, slips: bool = False, origin: int = 0):
        self.device = SimpleNamespace(registers=REGISTERS)
        self._random, self._goes, self._slips = random, goes, slips
        self._params, self._state, self._place, self._asked = Params(COUNT.format.width, 32, 8), START, 0, NO_STROBES
        self._state = self._state._replace(count=origin)
        self._passes(100)

    def _passes(self, clocks: int) -> None:
        """Let clocks pass."""
        for _ in range(clocks):
            if self._place < self._goes:
                self._place += int(self._state.index_armed)
            else:
                self._place = self._goes + int(self._random.integers(2))
            cell, z = self._place, int(INDEX_AT <= self._place < INDEX_AT + 3)
            inputs = Inputs(int((cell + 3) % 4 < 2), int((cell + 2) % 4 < 2), z)
            slip = int(self._slips and self._state.index_latched)
            self._state = quadrature.step(self._params, self._state, inputs, self._asked._replace(slip=slip))
            self._asked = NO_STROBES

    @property
    def status(self) -> SimpleNamespace:
        state = State.DISARMED
        return SimpleNamespace(
            state=state, position_m=self.read("count") * COUNT.lsb, referenced=self.read("referenced")
        )

    def renew(self) -> None:
        pass

    def read(self, name: str) -> int:
        self._passes(int(self._random.integers(1, 30)))
        return getattr(self._state, name)

    def pulse(self, name: str) -> None:
        self._asked = {"index_arm": Strobes(arm=1)}[name]
        self._passes(2)

    def shift_origin(self, by_m: float) -> None:
        # Words are written and committed before the pulse.
        self._passes(int(self._random.integers(1, 60)))
        self._asked = Strobes(origin_shift=1, preload_count=round(by_m / COUNT.lsb))
        self._passes(2)

    def off(self) -> int:
        """Let the handle rest; return by how many counts the count is not that of its place."""
        place = self._place
        self._random, self._goes = SimpleNamespace(integers=lambda *_: 0), place
        self._passes(20)
        return self._state.count - place


def home(axis: Trembling, index_m: float):
    steps = homing(axis, index_m)
    for _ in range(1000):
        try:
            assert next(steps) == INDEX
        except StopIteration as end:
            return end.value
    raise TimeoutError


@pytest.mark.parametrize("goes", [INDEX_AT, INDEX_AT + 1, 60])
def test_the_index_is_exactly_where_it_is_said_to_be(goes):
    random, off, wanted = rng(), [], 1234
    for _ in range(100):
        axis = Trembling(random, goes)
        homed = home(axis, wanted * COUNT.lsb)
        assert round(homed.moved_m / COUNT.lsb) == wanted - INDEX_AT
        assert axis.read("index_count") == wanted
        off.append(axis.off())
    assert set(off) == {wanted - INDEX_AT}


@pytest.mark.parametrize("side", [1, -1])
def test_an_origin_may_go_from_one_end_of_the_range_to_the_other(side):
    origin, wanted = side * COUNT.high * 9 // 10, -side * COUNT.high * 9 // 10
    axis = Trembling(rng(), 60, origin=origin)
    homed = home(axis, wanted * COUNT.lsb)
    assert round(homed.moved_m / COUNT.lsb) == wanted - INDEX_AT - origin
    assert (axis.read("index_count"), axis.read("wrapped"), axis.read("referenced")) == (wanted, 0, 1)


def test_a_way_that_leaves_the_range_is_refused_before_anything_has_moved():
    axis = Trembling(rng(), 60, origin=COUNT.high - 100)
    with pytest.raises(ValueError, match=r"index_m must leave the handle within .* to .*, not at "):
        home(axis, COUNT.high * COUNT.lsb)
    assert (axis.read("wrapped"), axis.read("index_count")) == (0, COUNT.high - 100 + INDEX_AT)


def test_a_scale_that_has_slipped_is_homed_again():
    with pytest.raises(NotReadyError, match=r"the scale has slipped since: .* home again"):
        home(Trembling(rng(), 60, slips=True), 0.0)


def test_an_index_that_would_take_the_handle_out_of_range_is_refused():
    with pytest.raises(ValueError, match=r"index_m must leave the handle within .* to .*, not at "):
        home(Trembling(rng(), 60), COUNT.high * COUNT.lsb)
