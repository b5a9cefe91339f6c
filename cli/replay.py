"""The command `replay`."""

from pathlib import Path
from typing import Annotated

import typer

from ..sim.estimates import replay_plan
from ..sim.estimates.replay import replay
from ..sim.estimates.settings import SettingError, settings_of
from .errors import BadInput
from .options import BackendOption, Estimator, OutputOption, output_file
from .readings import READING, ReadingOptions, say
from .study import study
from .terminal import progress

OPTIONS = {
    "output": "--output",
    "coarsen": "--coarsen",
    "acceleration_max_counts_per_s2": "--acceleration-max",
    "settings": "--set",
}
"""The options that give the arguments of a replay, by the names of these."""


@study("set_", "plot", *READING, kind=ReadingOptions)
def command(
    options: ReadingOptions,
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="a recording: CSV, NumPy, MATLAB, Parquet, sigrok or VCD")
    ],
    column: Annotated[
        str | None,
        typer.Option(help="column of counts, by name or number", show_default="the only one; else a capture of edges"),
    ] = None,
    coarsen: Annotated[
        int,
        typer.Option(
            min=1,
            max=replay_plan.COARSEN_MAX,
            help="divide the counts by this number, and measure the error against the undivided ones",
        ),
    ] = 1,
    estimator: Annotated[Estimator, typer.Option(help="velocity estimator")] = "levant",
    output: OutputOption = None,
    backend: BackendOption = "fixed",
    acceleration_max: Annotated[
        float | None,
        typer.Option(
            metavar="C",
            help="bound on the acceleration, which sets the gains, counts/s^2",
            show_default="the recording's",
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE.csv", help="write the velocities into this .csv")] = None,
) -> None:
    out = output_file(out, "--out", (".csv",), other_than=file)
    try:
        settings = settings_of(options.changes(), estimator)
    except SettingError as error:
        raise BadInput(f"--set {error}") from None
    recorded = options.read(file, column)
    try:
        with progress(f"{file.name} {estimator} {backend}", len(recorded.counts)) as advance:
            result = replay(recorded, estimator, output, backend, coarsen, acceleration_max, advance, settings)
    except replay_plan.ArgumentError as error:
        raise BadInput(f"{OPTIONS[error.argument]} {error.said}") from None
    except replay_plan.ReplayError as error:
        raise BadInput(str(error)) from None
    say(recorded)
    options.finish(result, {"velocities": (out, result.save)} if out else {})
