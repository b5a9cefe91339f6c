"""Connect to a board: open its port, identify it, and take its axis."""

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
    """Return the axis of the board at a port. No other program can use the port meanwhile. Nothing moves.

    If the board has several axes this is the first one; `connect_axes` returns all.

    Args:
        name: a serial port, e.g. /dev/ttyUSB0 or a path in /dev/serial/by-id; or tcp://HOST:PORT.
        baud: the baud rate of the board's line, 1 to `port.BAUD_MAX`.
        answer_s: a board that does not answer within this time is silent, s of the board's time.
        identity: the identity that the board must have; None for any.
        pace: the seconds of a slow simulation in a real second, or fewer, 0.001 to 1. Every wait and the lease of the
            application are divided by it. None: a virtual board on this machine tells its pace, whenever it changes;
            any other board has 1.

    Raises:
        FieldError: if a number is out of its range.
        PortError: if the port cannot be opened.
        SilentError: if nothing answers there.
        ForeignError: if another device answers, or an axis that this version does not know.
        ChangedError: if it has another identity.
    """
    return _held(Axis, Port(name, baud, answer_s, pace), identity)


def connect_axes(
    name: str, baud: int = BAUD, answer_s: float = ANSWER_S, identity: str | None = None, pace: float | None = None
) -> Axes:
    """Return all axes of the board at a port, also if it has only one. Arguments and errors: see `connect`."""
    return _held(Axes, Port(name, baud, answer_s, pace), identity)


def share(
    name: str,
    baud: int = BAUD,
    answer_s: float = ANSWER_S,
    identity: str | None = None,
    pace: float | None = None,
    number: int = 0,
) -> Relay:
    """Return a relay through which many programs share the board at a port, each by `connect(relay.name)`.

    `number` is the port of the loopback, 0 for any that is free. The other arguments and the errors are `connect`'s.
    """
    return _held(lambda port, device: Relay(port, device, number), Port(name, baud, answer_s, pace), identity)


def _held(hold: Callable[[Port, Device], Held], port: Port, identity: str | None) -> Held:
    """Return the axis, axes or relay that `hold` makes of the device at a port; check its identity if one is given."""
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
