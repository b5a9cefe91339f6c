"""The command `home`."""

from typing import Annotated

import typer

from ..host.port import BAUD
from ..model.runtime.result import Values
from .options import within
from .port import BaudOption, IdentityOption, PaceOption, PortArgument, axis_at
from .report import ReportOptions, reports
from .terminal import log


@reports()
def command(
    options: ReportOptions,
    port: PortArgument,
    at: Annotated[float, typer.Option(metavar="M", help="position that the index gets, m")] = 0.0,
    baud: BaudOption = BAUD,
    identity: IdentityOption = None,
    pace: PaceOption = None,
    seconds: Annotated[float, typer.Option(metavar="S", help="longest wait for the index, 0 to 1e6 s")] = 60.0,
) -> None:
    within(seconds, "--seconds", 0.0, 1e6, "s")
    with axis_at(port, baud, identity, pace) as axis:
        count = axis.device.registers["count"]
        within(at, "--at", count.low * count.lsb, count.high * count.lsb, "m")
        log.print("move the handle over its index")
        position_m = axis.home(at, seconds)
    options.finish(Values({"position_m": position_m}))
