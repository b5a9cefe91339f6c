"""Homing: a hand moves the handle over its index, and lets it rest; the index becomes a position."""

import time
from collections.abc import Generator
from typing import NamedTuple, Protocol

from ..model.checks import check_range
from .device import Device
from .errors import NotReadyError
from .status import State, Status

REST_S, REST_COUNTS = 0.3, 2
"""The time in which a handle that rests moves by so many counts at most."""
INDEX, REST = "the index: move the handle over it", "a handle that rests: let it"
"""What homing waits for, in this order."""


class Homed(NamedTuple):
    """An axis that is homed: the position of the handle, and how far all positions have moved, m."""

    position_m: float
    moved_m: float


class Board(Protocol):
    """What homing needs of an axis: see `hardwall.host.axis.Axis`."""

    device: Device

    @property
    def status(self) -> Status: ...

    def renew(self) -> None: ...

    def read(self, name: str) -> int: ...

    def pulse(self, name: str) -> None: ...

    def preload(self, position_m: float) -> None: ...


def homing(axis: Board, index_m: float, rest_s: float) -> Generator[str, None, Homed]:
    """Home an axis, a look at it at a step, for who has more to do between two.

    Yields what is waited for, `INDEX` or `REST`.

    Args:
        axis: the axis.
        index_m: the position that the index becomes.
        rest_s: the time in which a handle that rests moves by `REST_COUNTS` at most.

    Raises:
        FieldError: if `index_m` is beyond the range of positions.
        NotReadyError: if the axis is ARMED.
        HostError: if the board is not reached.
    """
    count = axis.device.registers["count"]
    check_range("index_m", index_m, count.low * count.lsb, count.high * count.lsb)
    axis.renew()
    if axis.status.state is State.ARMED:
        raise NotReadyError("the axis is ARMED: disarm it before it is homed")
    axis.pulse("index_arm")
    while axis.read("index_armed"):
        yield INDEX
    rest_m = (REST_COUNTS + 0.5) * count.lsb
    at_m, since_s = axis.status.position_m, time.monotonic()
    while time.monotonic() - since_s < rest_s:
        yield REST
        if abs((now_m := axis.status.position_m) - at_m) > rest_m:
            at_m, since_s = now_m, time.monotonic()
    moved_m = index_m - axis.read("index_count") * count.lsb
    axis.preload(axis.status.position_m + moved_m)
    return Homed(axis.status.position_m, moved_m)
