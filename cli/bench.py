"""The command `bench`."""

from pathlib import Path
from typing import Annotated

import typer

from ..sim.scene.case import Case
from ..sim.studies import bench, waiting_time
from .errors import BadInput
from .scenes import SceneArgument
from .study import StudyOptions, study
from .terminal import log


@study()
def command(
    options: StudyOptions,
    scene: SceneArgument = "mhz",
    against: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="checkout (after `make tools`) or environment with another hardwall, timed in turns with this one",
        ),
    ] = None,
) -> None:
    try:
        program = against and waiting_time.program_of(against)
    except ValueError as error:
        raise BadInput(f"--against {error}") from None
    options.finish(bench.study(Case.of(scene), log.print, program))
