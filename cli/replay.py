"""The command `replay`."""

from pathlib import Path
from typing import Annotated

import typer

from ..sim.estimates import recording, replay
from .errors import BadInput
from .options import BackendOption, Estimator, OutputOption, output_file
from .study import StudyOptions, study
from .terminal import progress

OPTIONS = {"output": "--output", "coarsen": "--coarsen", "acceleration_max_counts_per_s2": "--acceleration-max"}
"""The options that give the arguments of a replay, by the names of these."""


@study("plot")
def command(
    options: StudyOptions,
    file: Annotated[Path, typer.Argument(metavar="FILE.csv", help="a recording, its first line the columns' names")],
    column: Annotated[str, typer.Option(help="the column of encoder counts")],
    rate: Annotated[
        float | None, typer.Option(metavar="HZ", help="sample rate", show_default="from column time_s")
    ] = None,
    coarsen: Annotated[
        int, typer.Option(min=1, max=replay.COARSEN_MAX, help="divide the counts, and judge against the full ones")
    ] = 1,
    estimator: Annotated[Estimator, typer.Option(help="velocity estimator")] = "levant",
    output: OutputOption = None,
    backend: BackendOption = "fixed",
    acceleration_max: Annotated[
        float | None,
        typer.Option(metavar="C", help="acceleration that sets the gains, counts/s^2", show_default="the recording's"),
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE.csv", help="file for the velocities")] = None,
) -> None:
    out = output_file(out, "--out", (".csv",), other_than=file)
    try:
        recorded = recording.load(file, column, rate)
        with progress(f"{file.name} {estimator} {backend}", len(recorded.counts)) as advance:
            result = replay.replay(recorded, estimator, output, backend, coarsen, acceleration_max, progress=advance)
    except replay.ArgumentError as error:
        raise BadInput(f"{OPTIONS[error.argument]} {error.said}") from None
    except (recording.RecordingError, replay.ReplayError) as error:
        raise BadInput(str(error)) from None
    options.finish(result, {"velocities": (out, result.save)} if out else {})
