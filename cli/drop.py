"""The command `drop`."""

from functools import partial

from ..sim.jobs.store import Store
from ..sim.scene.case import Case
from ..sim.studies import drop
from ..sim.walls.mapping import STARTS
from .maps import mapper_of
from .options import ModelOption, StartsOption
from .scenes import WALL, SceneArgument, refuse
from .study import StudyOptions, study


@study("workers", "resume", "set_", "plot")
def command(
    options: StudyOptions,
    scene: SceneArgument = "seed-2011",
    starts: StartsOption = STARTS,
    backend: ModelOption = "fixed",
) -> None:
    changes = options.changes()
    refuse_methods_and_walls(changes)
    run = partial(options.results, store=Store("drop", options.resume))
    options.finish(drop.study(Case.of(scene, changes), backend, run, mapper_of(options, backend, starts)))


def refuse_methods_and_walls(changes: dict) -> None:
    """Refuse the changes that studies of the paper's Figure 5 make themselves; changes of gains are accepted."""
    refuse(changes, ("controller.estimator", "controller.output"), "it compares methods")
    refuse(changes, WALL, "it hits many walls")
