"""The command `capture`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from ..host import Axis, NotReadyError
from ..host.capture import Captured
from ..host.port import BAUD
from ..model.axis.capture import DECIMATION_BITS, RECORDS_MAX, SOURCES
from ..model.checks import shown
from ..model.runtime import termination
from ..model.runtime.result import Summary
from .errors import BadInput
from .options import output_file, within
from .port import BaudOption, IdentityOption, PaceOption, PortArgument, axis_at
from .report import ReportOptions, reports
from .set import values_of
from .terminal import log, progress

DECIMATION_MAX = (1 << DECIMATION_BITS) - 1
TRIGGER, HAND = "contact", "hand"
"""The default trigger; and the trigger by hand, which comes as soon as enough records are there before it."""


@dataclass(frozen=True)
class Captures(Summary):
    """A capture, and its report.

    Attributes:
        captured: the capture.
    """

    captured: Captured

    def report(self) -> dict[str, Any]:
        found = self.captured
        motions = {
            "speed_most_m_per_s": found.velocity_m_per_s,
            "acceleration_most_m_per_s2": found.acceleration_m_per_s2,
        }
        return {
            "identity": found.identity,
            "records": len(found.time_s),
            "before": found.place,
            "from_s": float(found.time_s[0]),
            "to_s": float(found.time_s[-1]),
            "position_least_m": float(found.position_m.min()),
            "position_most_m": float(found.position_m.max()),
            **{name: float(abs(values).max()) for name, values in motions.items() if values is not None},
            "force_most_n": float(abs(found.force_n).max()),
            "flags": [name for name in found.flag_names if found.flag(name).any()],
        }


@reports("plot")
def command(
    options: ReportOptions,
    port: PortArgument,
    words: Annotated[
        list[str] | None,
        typer.Argument(metavar="WORD=VALUE...", help="words to write first, in SI units, e.g. wall_stiffness=2e3"),
    ] = None,
    trigger: Annotated[
        str, typer.Option(metavar="NAME,...", help=f"triggers: {', '.join((*SOURCES, HAND))} (without an event)")
    ] = TRIGGER,
    before: Annotated[
        int | None,
        typer.Option(
            min=0, max=RECORDS_MAX, help="number of records before the trigger", show_default="a quarter of all records"
        ),
    ] = None,
    decimation: Annotated[
        int, typer.Option(min=1, max=DECIMATION_MAX, help="samples per record: 1 records every sample")
    ] = 1,
    level: Annotated[
        float, typer.Option(metavar="M", help="position at which the triggers rise and fall act, m")
    ] = 0.0,
    acceleration: Annotated[
        bool, typer.Option("--acceleration", help="record the acceleration in place of the velocity")
    ] = False,
    arm: Annotated[bool, typer.Option("--arm", help="arm the axis first; disarm it at the end")] = False,
    last: Annotated[
        bool, typer.Option("--last", help="read the capture that the board already has, without starting one")
    ] = False,
    seconds: Annotated[float, typer.Option(metavar="S", help="longest wait for the trigger, 0 to 1e6 s")] = 60.0,
    baud: BaudOption = BAUD,
    identity: IdentityOption = None,
    pace: PaceOption = None,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE.npz", help="write the records into this .npz")
    ] = None,
) -> None:
    within(seconds, "--seconds", 0.0, 1e6, "s")
    out = output_file(out, "--out", (".npz",))
    values, sources = values_of(words or []), _sources(trigger)
    if last and (words or arm or acceleration or (trigger, before, decimation, level) != (TRIGGER, None, 1, 0.0)):
        others = "--arm, --trigger, --before, --decimation, --level or --acceleration"
        raise BadInput(f"--last reads a finished capture: no word, {others}")
    with axis_at(port, baud, identity, pace) as axis:
        if values:
            axis.set(**values)
        if arm:
            axis.arm()
        if not last:
            events = [source for source in sources if source != HAND]
            axis.capture.start(events, before, decimation, level, acceleration)
            _wait(axis, HAND in sources, seconds)
        captured = _read(axis, port, lives=not last)
    options.finish(Captures(captured), {"records": (out, captured.save)} if out else {})


def _sources(text: str) -> list[str]:
    sources = text.split(",")
    for source in sources:
        if source not in (*SOURCES, HAND):
            raise BadInput(f"--trigger must be of {', '.join((*SOURCES, HAND))}, not {shown(source)}")
    return sources


def _wait(axis: Axis, by_hand: bool, seconds: float) -> None:
    """Wait until a capture is done; by hand it is triggered as soon as it waits for that."""
    log.print(f"the capture of {axis.capture.records} records waits for its trigger")
    if by_hand:
        axis.capture.until("WAITING", seconds)
        axis.capture.trigger()
    axis.capture.until("DONE", seconds)


def _read(axis: Axis, port: str, lives: bool) -> Captured:
    """Return the capture of a board that is done. However this run ends, it says that the board keeps the capture."""
    termination.said_by(lambda: f"the board keeps the capture: `hardwall capture {port} --last` reads it again")
    try:
        with progress("reading the capture", axis.capture.records) as advance:
            return axis.capture.read(advance, lives)
    except NotReadyError:
        # It has none, or began another one.
        termination.begin()
        raise
