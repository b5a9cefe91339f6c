"""The command `fit`."""

from typing import Annotated, Literal

import typer

from ..sim.scene.case import Case
from ..sim.studies import fit
from ..sim.walls.methods import methods
from .drop import refuse_methods_and_walls
from .maps import mapper_of_one_pool
from .options import ModelOption, StartsOption
from .scenes import SceneArgument, refuse
from .study import StudyOptions, study
from .terminal import progress


@study("workers", "scheduler", "resume", "set_")
def command(
    options: StudyOptions,
    scene: SceneArgument = "seed-2011",
    reading: Annotated[
        Literal["3-30", "30-300"] | None,
        typer.Option(
            "--axis",
            metavar="B",
            help="assumed range of the damping axis of Figure 5, N s/m: 3-30 or 30-300",
            show_default="both",
        ),
    ] = None,
    evaluations: Annotated[
        int, typer.Option(min=1, max=10**9, help="approximate number of devices that a search tries")
    ] = 576,
    seed: Annotated[int, typer.Option(min=0, max=2**32 - 1, help="seed of the random numbers of the searches")] = 1,
    starts: StartsOption = 3,
    backend: ModelOption = "fixed",
) -> None:
    changes, fits = options.changes(), []
    refuse_methods_and_walls(changes)
    refuse(changes, ("zwidth",), "its maps go a little beyond the paper's axes")
    case = Case.of(scene, changes)
    with mapper_of_one_pool(options, backend, starts, len(methods())) as mapper:
        for each in [reading] if reading else fit.READINGS:
            with progress(f"{case.scene.name}, B axis {each}", evaluations) as advance:
                fits.append(fit.study(case, each, evaluations, seed, mapper, advance))
    options.finish(fit.Fits(case.scene, fits, seed, mapper.effort()))
