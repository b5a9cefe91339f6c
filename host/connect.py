"""The way to a board: open its port, see what it is, and take hold of its axis."""

from collections.abc import Callable
from typing import TypeVar

from .axis import Axis
from .banks import Axes
from .device import Device, read_device
from .errors import ChangedError
from .port import ANSWER_S, BAUD, Port
from .relay import Relay

Held = TypeVar("Held")


def connect(
    name: str, baud: int = BAUD, answer_s: float = ANSWER_S, identity: str | None = None, pace: float | None = None
) -> Axis:
    """Return the axis of the board at a port, which no other program can use meanwhile. Nothing moves.

    Of a board of several axes it is the first one: `connect_axes` has them all.

    Args:
        name: a serial port's path, for instance of `/dev/serial/by-id`; or tcp://HOST:PORT.
        baud: the board's rate.
        answer_s: the time behind which a board without an answer is silent, in the board's time.
        identity: the identity that the board must have; None for any.
        pace: of a simulation that is slower than a board, its seconds in a second, or fewer: every wait for it, and the
            lease of the application, is longer by that. None: what a virtual board on this machine tells, whenever it
            changes; and 1 of any other.

    Raises:
        FieldError: if a number is out of its range.
        PortError: if the port cannot be had.
        SilentError: if nothing answers there.
        ForeignError: if what answers is no axis that this version knows.
        ChangedError: if it has another identity.
    """
    return _held(Axis, Port(name, baud, answer_s, pace), identity)


def connect_axes(
    name: str, baud: int = BAUD, answer_s: float = ANSWER_S, identity: str | None = None, pace: float | None = None
) -> Axes:
    """Return all axes of the board at a port; of a board of one axis that one. Arguments and errors are `connect`'s."""
    return _held(Axes, Port(name, baud, answer_s, pace), identity)


def share(
    name: str,
    baud: int = BAUD,
    answer_s: float = ANSWER_S,
    identity: str | None = None,
    pace: float | None = None,
    number: int = 0,
) -> Relay:
    """Return what lets many programs have the board at a port, each by `connect(relay.name)`.

    `number` is the port of the loopback, 0 for any that is free. The other arguments and the errors are `connect`'s.
    """
    return _held(lambda port, device: Relay(port, device, number), Port(name, baud, answer_s, pace), identity)


def _held(hold: Callable[[Port, Device], Held], port: Port, identity: str | None) -> Held:
    """Return what takes hold of the device at a port, which must have an identity, if one is given."""
    try:
        device = read_device(port)
        if identity not in (None, device.identity):
            raise ChangedError(
                f"the board at {port.name} is {device.identity}, not {identity}: it has another bitstream"
            )
        return hold(port, device)
    except BaseException:
        port.close()
        raise
