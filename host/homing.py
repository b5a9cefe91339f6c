"""Homing: a hand moves the handle over its index, and the index becomes a position."""

from collections.abc import Generator
from typing import NamedTuple, Protocol

from ..model.checks import FieldError
from .bounds import check_within
from .device import Device
from .errors import NotReadyError
from .status import State, Status

INDEX = "the index: move the handle over it"
"""The event that homing waits for."""
LOST = "the index was found, but the scale has slipped since: see to the encoder, clear what it says, and home again"


class Homed(NamedTuple):
    """An axis that is homed: the position of the handle, and how far all positions have moved, m."""

    position_m: float
    moved_m: float


class Board(Protocol):
    """The part of `hardwall.host.axis.Axis` that homing needs."""

    device: Device

    @property
    def status(self) -> Status: ...

    def renew(self) -> None: ...

    def read(self, name: str) -> int: ...

    def pulse(self, name: str) -> None: ...

    def shift_origin(self, by_m: float) -> None: ...


def homing(axis: Board, index_m: float) -> Generator[str, None, Homed]:
    """Home an axis, one look at it per step, so that a caller can do other things in between.

    The handle may move all the time: the board latches the place of the index, and moves its origin at one clock.

    Yields what is waited for, `INDEX`.

    Args:
        axis: the axis.
        index_m: the position that the index becomes.

    Raises:
        FieldError: if `index_m` is beyond the range of positions, or would take the handle beyond it.
        NotReadyError: if the axis is ARMED, or its scale has slipped since the index was found.
        HostError: if the board is not reached.
    """
    count = axis.device.registers["count"]
    check_within("index_m", count, index_m)
    axis.renew()
    if axis.status.state is State.ARMED:
        raise NotReadyError("the axis is ARMED: disarm it before it is homed")
    axis.pulse("index_arm")
    while axis.read("index_armed"):
        yield INDEX
    index = axis.read("index_count")
    if not axis.read("index_latched"):
        raise NotReadyError(LOST)
    place = min(max(round(index_m / count.lsb), count.low), count.high)
    by = place - index
    handle = axis.read("count") + by
    if not count.low <= handle <= count.high:
        within = f"{count.low * count.lsb:g} to {count.high * count.lsb:g}"
        raise FieldError("index_m", f"must leave the handle within {within}, not at {handle * count.lsb:g}")
    # The word of a shift has the range of a position: a longer way is two shifts, between two places in the range.
    for part in (by,) if count.low <= by <= count.high else (by // 2, by - by // 2):
        axis.shift_origin(part * count.lsb)
    status = axis.status
    if not status.referenced:
        raise NotReadyError(LOST)
    return Homed(status.position_m, by * count.lsb)
