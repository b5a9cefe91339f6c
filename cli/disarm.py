"""The command `disarm`."""

from ..host.port import BAUD
from ..model.runtime.result import Values
from .port import AcknowledgeOption, BaudOption, IdentityOption, PaceOption, PortArgument, axis_at
from .report import ReportOptions, reports


@reports()
def command(
    options: ReportOptions,
    port: PortArgument,
    baud: BaudOption = BAUD,
    identity: IdentityOption = None,
    pace: PaceOption = None,
    acknowledge: AcknowledgeOption = False,
) -> None:
    with axis_at(port, baud, identity, pace) as axis:
        axis.disarm()
        if acknowledge:
            axis.acknowledge()
        state = axis.status.state.name
    options.finish(Values({"state": state}))
