"""The command `assumptions`."""

from ..sim.scene.case import Case
from ..sim.studies import assumptions
from ..sim.walls.methods import methods
from .drop import refuse_methods_and_walls
from .maps import mapper_of_one_pool
from .options import ModelOption, StartsOption
from .scenes import SceneArgument
from .study import StudyOptions, study
from .terminal import progress


@study("workers", "scheduler", "resume", "set_")
def command(
    options: StudyOptions,
    scene: SceneArgument = "figure-5-2011",
    starts: StartsOption = 3,
    backend: ModelOption = "fixed",
) -> None:
    changes = options.changes()
    refuse_methods_and_walls(changes)
    case = Case.of(scene, changes)
    number = len(list(assumptions.changes_of(case.scene)))
    with (
        mapper_of_one_pool(options, backend, starts, len(methods())) as mapper,
        progress(f"{case.scene.name}, {number} changes", number) as advance,
    ):
        options.finish(assumptions.study(case, mapper, advance))
