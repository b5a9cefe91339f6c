"""The command `watch`."""

import sys
import time

from rich.live import Live
from rich.text import Text

from ..host import Status
from ..host.port import BAUD
from .options import within
from .port import BaudOption, IdentityOption, PaceOption, PortArgument, SecondsOption, axis_at, line_of

PERIOD_S = 0.05
"""The time between two looks at the board."""
LINE_S = 1.0
"""The time between two lines where stdout is no terminal."""


class Lines:
    """A status for people: a line that changes in a terminal, elsewhere a line every `LINE_S`. A context manager."""

    def __init__(self) -> None:
        self._live = Live(auto_refresh=False) if sys.stdout.isatty() else None
        self._next_s = 0.0

    def __enter__(self) -> "Lines":
        if self._live:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live:
            self._live.stop()

    def show(self, status: Status) -> None:
        """Show a status."""
        if self._live:
            self._live.update(Text(line_of(status)), refresh=True)
        elif time.monotonic() >= self._next_s:
            self._next_s = time.monotonic() + LINE_S
            print(line_of(status), flush=True)


def command(
    port: PortArgument,
    baud: BaudOption = BAUD,
    identity: IdentityOption = None,
    pace: PaceOption = None,
    seconds: SecondsOption = None,
) -> None:
    if seconds is not None:
        within(seconds, "--seconds", 0.0, 1e6, "s")
    with axis_at(port, baud, identity, pace) as axis, Lines() as lines:
        began = time.monotonic()
        while seconds is None or time.monotonic() - began < seconds:
            lines.show(axis.status)
            time.sleep(PERIOD_S)
