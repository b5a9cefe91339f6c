"""The command `watch`."""

import json
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.live import Live
from rich.text import Text

from ..host import Sample, SampleFile, Samples, Status
from ..host.port import BAUD
from ..host.samples import RATE_HZ, RATE_LEAST_HZ, RATE_MOST_HZ
from ..model.checks import shown
from ..model.runtime import termination
from .errors import BadInput
from .options import output_file, within
from .port import BaudOption, IdentityOption, PaceOption, PortArgument, SecondsOption, axis_at, line_of
from .terminal import log

LINE_S = 1.0
"""The time between two lines where stdout is no terminal."""
SILENT = "SILENT   the board does not answer"


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

    def show(self, status: Status | None) -> None:
        """Show a status; None is a board that does not answer."""
        line = line_of(status) if status else SILENT
        if self._live:
            self._live.update(Text(line), refresh=True)
        elif time.monotonic() >= self._next_s:
            self._next_s = time.monotonic() + LINE_S
            print(line, flush=True)


def command(
    port: PortArgument,
    baud: BaudOption = BAUD,
    identity: IdentityOption = None,
    pace: PaceOption = None,
    seconds: SecondsOption = None,
    rate: Annotated[float, typer.Option(metavar="HZ", help="samples in a second, 1e-3 to 1e3 Hz")] = RATE_HZ,
    csv: Annotated[
        Path | None, typer.Option(metavar="FILE.csv", help="write each sample as a line of this new file")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="print each sample as a JSON object, on a line of its own")
    ] = False,
) -> None:
    if seconds is not None:
        within(seconds, "--seconds", 0.0, 1e6, "s")
    within(rate, "--rate", RATE_LEAST_HZ, RATE_MOST_HZ, "Hz")
    if output_file(csv, "--csv", (".csv",)) and os.path.lexists(csv):
        raise BadInput(f"--csv must be a new file, not {shown(str(csv))}, which exists")
    with axis_at(port, baud, identity, pace) as axis, ExitStack() as stack:
        samples = Samples(axis, rate, seconds)
        termination.said_by(lambda: str(samples))
        takers: list[Callable[[Sample], object]] = []
        if csv:
            csv.parent.mkdir(parents=True, exist_ok=True)
            takers.append(stack.enter_context(closing(SampleFile(csv))).add)
        if as_json:
            takers.append(stack.enter_context(_objects(samples, axis.device.identity)))
        else:
            lines = stack.enter_context(Lines())
            takers.append(lambda sample: lines.show(sample.status))
        for sample in samples:
            for take in takers:
                take(sample)
    log.print(f"{samples}", soft_wrap=True)


@contextmanager
def _objects(samples: Samples, identity: str) -> Iterator[Callable[[Sample], object]]:
    """Yield a function that prints a sample as an object. However this ends, the last object tells the missed
    samples."""
    ended: list[bool] = []

    def end(write: Callable[[str], object]) -> None:
        if not ended:
            ended.append(True)
            gaps = [gap._asdict() for gap in samples.gaps]
            said = {"samples": samples.taken, "rate_hz": samples.rate_hz, "missed": samples.missed, "gaps": gaps}
            write(json.dumps({"identity": identity, **said}) + "\n")

    def take(sample: Sample) -> None:
        if not ended:
            _print(json.dumps(sample.row) + "\n")

    # A print that a signal has interrupted holds stdout for good; every object before has gone out.
    with termination.undone_by_signal(lambda: end(lambda text: os.write(1, text.encode()))):
        try:
            yield take
        finally:
            end(_print)


def _print(text: str) -> None:
    print(text, end="", flush=True)
