"""The command `disarm`."""

from ..jobs.result import Values
from .port import RATE, BaudOption, IdentityOption, PortArgument, axis_at
from .study import StudyOptions, study


@study()
def command(
    options: StudyOptions, port: PortArgument, baud: BaudOption = RATE, identity: IdentityOption = None
) -> None:
    with axis_at(port, baud, identity) as axis:
        axis.disarm()
        state = axis.status.state.name
    options.finish(Values({"state": state}))
