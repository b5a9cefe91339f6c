"""The command `arm`."""

from typing import Annotated

import typer

from ..host import State, TrippedError
from ..host.port import BAUD
from .options import within
from .port import AcknowledgeOption, BaudOption, IdentityOption, PaceOption, PortArgument, SecondsOption, axis_at
from .set import values_of
from .watch import Lines

OPENED = "the loop of drive_enable opened, or another program disarmed it"


def command(
    port: PortArgument,
    words: Annotated[
        list[str] | None,
        typer.Argument(metavar="WORD=VALUE...", help="words to write first, in SI units, e.g. wall_stiffness=2e3"),
    ] = None,
    baud: BaudOption = BAUD,
    identity: IdentityOption = None,
    pace: PaceOption = None,
    acknowledge: AcknowledgeOption = False,
    seconds: SecondsOption = None,
) -> None:
    if seconds is not None:
        within(seconds, "--seconds", 0.0, 1e6, "s")
    values = values_of(words or [])
    with axis_at(port, baud, identity, pace) as axis, Lines() as lines:
        if values:
            axis.set(**values)
        if acknowledge:
            axis.acknowledge()
        axis.arm()
        for status in axis.watch(seconds=seconds):
            lines.show(status)
            if status.state is not State.ARMED:
                raise TrippedError(f"the axis is {status.state.name}: {status.trip or OPENED}")
