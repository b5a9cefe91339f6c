"""The common part of the commands for a board: options, its axis, and its errors."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated

import typer

from ..host import Axis, Status, connect
from ..host.port import BAUD_MAX
from ..model.checks import FieldError
from ..model.link.board_pace import PACE_LEAST
from ..model.runtime import termination
from .errors import BadInput
from .options import within

PortArgument = Annotated[
    str,
    typer.Argument(
        metavar="PORT", help="serial port, e.g. /dev/ttyUSB0 or a name in /dev/serial/by-id; or tcp://HOST:PORT"
    ),
]
BaudOption = Annotated[int, typer.Option(min=1, max=BAUD_MAX, help="baud rate of the board's serial line")]
IdentityOption = Annotated[
    str | None,
    typer.Option(
        metavar="HASH", help="refuse a board with another identity, as `hardwall connect` shows it", show_default="any"
    ),
]
AcknowledgeOption = Annotated[bool, typer.Option("--acknowledge", help="acknowledge the latched causes of a trip")]
SecondsOption = Annotated[
    float | None, typer.Option(metavar="S", help="time to run, 0 to 1e6 s", show_default="until interrupted")
]
PaceOption = Annotated[
    float | None,
    typer.Option(
        metavar="PACE",
        help="speed of a slow simulation, 0.001 to 1: its seconds in a real second, or fewer",
        show_default="told by a board on this machine, else 1",
    ),
]


def check_pace(pace: float | None) -> None:
    """Raise BadInput if no board can have such a pace."""
    if pace is not None:
        within(pace, "--pace", PACE_LEAST, 1.0, "s/s")


@contextmanager
def axis_at(port: str, baud: int, identity: str | None, pace: float | None) -> Iterator[Axis]:
    """Yield the axis at a port, and disarm and close it, also when a signal ends the program."""
    check_pace(pace)
    try:
        with connect(port, baud, identity=identity, pace=pace) as axis, termination.undone_by_signal(axis.close):
            yield axis
    except FieldError as error:
        raise BadInput(str(error)) from None


def line_of(status: Status) -> str:
    """Return a status as a line for people."""
    said = f"; {status.trip}" if status.trip else f"; {', '.join(status.flags)}" if status.flags else ""
    acceleration = status.acceleration_m_per_s2
    accelerates = "" if acceleration is None else f"{acceleration:9.3f} m/s^2 "
    return (
        f"{status.state.name:8} {1e3 * status.position_m:10.4f} mm {1e3 * status.velocity_m_per_s:9.3f} mm/s "
        f"{accelerates}{status.force_n:9.4f} N{said}"
    )
