"""The options for reading a recording, shared by `replay` and `accuracy`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from ..model.checks import shown
from ..sim.recordings.counter import BITS, MODULI
from ..sim.recordings.counts import UNITS, size_of
from ..sim.recordings.error import RecordingError
from ..sim.recordings.gaps import RULES
from ..sim.recordings.load import load
from ..sim.recordings.recording import Reading, Recording
from ..sim.recordings.stamps import UNITS as TIME_UNITS
from .errors import BadInput, one_line
from .study import StudyOptions
from .terminal import log, progress

CHANNELS = 2, 3
"""The least and the most channels of an encoder: A and B, and Z."""


@dataclass(frozen=True, kw_only=True)
class ReadingOptions(StudyOptions):
    """The options of a recording and of a study; `--set` takes the keys of a replay instead of a scene's."""

    set_: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="controller.KEY=VALUE",
            help="change gains.ESTIMATOR.NAME, jerk_max_counts_per_s3 or edge_error_max_counts, in counts, not m",
        ),
    ] = None
    rate: Annotated[
        float | None, typer.Option(metavar="HZ", help="sample rate of a recording, Hz", show_default="from its times")
    ] = None
    time: Annotated[
        str | None,
        typer.Option(
            metavar="COLUMN",
            help="column of times, by name or number; `none`: the file has no times",
            show_default="found by its name",
        ),
    ] = None
    time_unit: Annotated[
        Literal[(*TIME_UNITS, "iso")] | None,
        typer.Option(help="unit of the times", show_default="found by the column's name or by --rate"),
    ] = None
    unit: Annotated[Literal[UNITS], typer.Option(help="unit of the positions")] = "counts"
    count: Annotated[
        str | None,
        typer.Option(metavar="SIZE", help="size of a count in the unit --unit, e.g. 0.005, 360/40000 or 2pi/2048"),
    ] = None
    counter_bits: Annotated[
        int | None,
        typer.Option(
            min=BITS[0], max=BITS[1], help="width of the counter that wraps, bits", show_default="found by its jumps"
        ),
    ] = None
    counter_modulus: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=MODULI[0], max=MODULI[1], help="range of a counter that wraps at another number, counts"
        ),
    ] = None
    gaps: Annotated[
        Literal[RULES],
        typer.Option(
            help="missing samples: refuse the recording, hold the count, or split there and take the longest piece"
        ),
    ] = "refuse"
    channels: Annotated[
        str | None,
        typer.Option(
            metavar="A,B[,Z]",
            help="channels of a logic analyser's capture, by name or number",
            show_default="found by their names",
        ),
    ] = None

    @property
    def reading(self) -> Reading:
        """The options for reading a file, checked.

        Raises:
            BadInput: if they contradict each other.
        """
        size = None if self.count is None else size_of(self.count)
        if self.count is not None and size is None:
            raise BadInput(f"--count must be a positive number, or as 360/40000 or 2pi/2048, not {shown(self.count)}")
        if size is not None and self.unit == "counts":
            raise BadInput("--count needs --unit rad, deg, turns or m: it is the size of a count in that unit")
        if self.counter_bits is not None and self.counter_modulus is not None:
            raise BadInput("--counter-modulus and --counter-bits are both the range of the counter: give one of them")
        channels = tuple(each.strip() for each in self.channels.split(",")) if self.channels else ()
        if self.channels is not None and not CHANNELS[0] <= len(channels) <= CHANNELS[1]:
            raise BadInput(
                f"--channels must be two or three names or numbers, A,B or A,B,Z, not {shown(self.channels)}"
            )
        return Reading(
            time=self.time,
            time_unit=self.time_unit,
            unit=self.unit,
            count=size,
            counter_bits=self.counter_bits,
            counter_modulus=self.counter_modulus,
            gaps=self.gaps,
            channels=channels,
        )

    @property
    def given(self) -> list[str]:
        """The options of a recording that are given."""
        return [f"--{each.replace('_', '-')}" for each in READING if getattr(self, each) != getattr(type(self), each)]

    def read(self, file: str | Path, column: str | None) -> Recording:
        """Return the recording in a file.

        Raises:
            BadInput: if it is refused.
        """
        try:
            with progress(f"reading {Path(file).name}", _size(file)) as advance:
                return load(file, column, self.rate, self.reading, advance)
        except RecordingError as error:
            raise BadInput(str(error)) from None


def say(recorded: Recording) -> None:
    """Print on stderr how a file was read. It comes with the result, because a refusal is one line alone."""
    said = f"{Path(recorded.file).name}: {'; '.join(recorded.notes)}"
    log.print(one_line(said), style="dim", soft_wrap=True)


READING = "rate", "time", "time_unit", "unit", "count", "counter_bits", "counter_modulus", "gaps", "channels"
"""The names of the options of a recording."""


def _size(file: str | Path) -> int:
    """Return the size of a file, bytes; 1 for a missing file, which is reported when it is read."""
    try:
        return max(Path(file).stat().st_size, 1)
    except OSError:
        return 1
