"""The command `cutoff`."""

from typing import Annotated

import typer

from ..sim.scene.case import Case
from ..sim.scene.load import names
from ..sim.studies import cutoff
from ..sim.walls.mapping import STARTS
from .maps import mapper_of
from .options import ModelOption, StartsOption
from .scenes import refuse_for_maps
from .study import StudyOptions, study


@study("workers", "scheduler", "resume", "set_", "plot")
def command(
    options: StudyOptions,
    scenes: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="SCENE...",
            help=f"scenes: {', '.join(names())}, or .toml files",
            show_default=", ".join(cutoff.SCENES),
        ),
    ] = None,
    starts: StartsOption = STARTS,
    backend: ModelOption = "fixed",
) -> None:
    changes = options.changes()
    refuse_for_maps(changes, "it searches them")
    cases = [Case.of(scene, changes) for scene in dict.fromkeys(scenes or cutoff.SCENES)]
    options.finish(cutoff.study(cases, mapper_of(options, backend, starts)))
