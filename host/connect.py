"""The way to a board: open its port, see what it is, and take hold of its axis."""

from .axis import Axis
from .device import read_device
from .errors import ChangedError
from .port import ANSWER_S, BAUD, Port


def connect(name: str, baud: int = BAUD, answer_s: float = ANSWER_S, identity: str | None = None) -> Axis:
    """Return the axis of the board at a port, which no other program can use meanwhile. Nothing moves.

    Args:
        name: a serial port's path, for instance of `/dev/serial/by-id`; or tcp://HOST:PORT.
        baud: the board's rate.
        answer_s: how long an answer is waited for; more than the default for simulations that are very slow.
        identity: the identity that the board must have; None for any.

    Raises:
        FieldError: if a number is out of its range.
        PortError: if the port cannot be had.
        SilentError: if nothing answers there.
        ForeignError: if what answers is no axis that this version knows.
        ChangedError: if it has another identity.
    """
    port = Port(name, baud, answer_s)
    try:
        device = read_device(port)
        if identity not in (None, device.identity):
            raise ChangedError(f"the board at {name} is {device.identity}, not {identity}: it has another bitstream")
        return Axis(port, device)
    except BaseException:
        port.close()
        raise
