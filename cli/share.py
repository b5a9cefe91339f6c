"""The command `share`."""

import time
from contextlib import ExitStack
from typing import Annotated

import typer

from ..host import share
from ..host.port import BAUD
from ..model.checks import FieldError
from ..model.link.board_pace import MARGIN, Teller
from ..model.runtime import termination
from .errors import BadInput
from .options import within
from .port import BaudOption, IdentityOption, PaceOption, PortArgument, SecondsOption, check_pace

LOOK_S = 0.02
"""The time between two looks at who holds the lease."""


def command(
    port: PortArgument,
    baud: BaudOption = BAUD,
    identity: IdentityOption = None,
    pace: PaceOption = None,
    tcp: Annotated[
        int,
        typer.Option(min=0, max=65535, metavar="PORT", help="port of 127.0.0.1 for the programs; 0 takes any free one"),
    ] = 0,
    seconds: SecondsOption = None,
) -> None:
    if seconds is not None:
        within(seconds, "--seconds", 0.0, 1e6, "s")
    check_pace(pace)
    with ExitStack() as stack:
        try:
            relay = stack.enter_context(share(port, baud, identity=identity, pace=pace, number=tcp))
        except FieldError as error:
            raise BadInput(str(error)) from None
        stack.enter_context(termination.undone_by_signal(relay.close))
        # A board with the pace of the clock is waited for as if nobody told its pace.
        teller = stack.enter_context(Teller([relay.name])) if relay.pace < 1.0 else None
        if teller:
            teller.tell(relay.pace * MARGIN)
        print(f"shared port: {relay.name}", flush=True)
        until_s, said = None if seconds is None else time.monotonic() + seconds, None
        while until_s is None or time.monotonic() < until_s:
            if relay.failure:
                raise relay.failure
            if (holder := relay.holder) != said:
                said = holder
                print(f"lease: {holder or 'free'}", flush=True)
            if teller:
                # It tells less than it is told, by that margin.
                teller.tell(relay.pace * MARGIN)
            time.sleep(LOOK_S)
