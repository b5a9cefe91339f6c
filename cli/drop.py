"""The command `drop`."""

from ..sim.jobs.store import Store
from ..sim.scene.case import Case
from ..sim.studies import drop
from ..sim.walls.zwidth import STARTS
from .maps import Maps
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
    changes, known = options.changes(), Store("drop", options.resume)
    refuse_methods_and_walls(changes)

    def striking(title: str, jobs: list[dict]) -> list[dict]:
        return options.results(title, drop.strike, jobs, known)

    options.finish(drop.study(Case.of(scene, changes), backend, striking, Maps(options, backend, starts)))


def refuse_methods_and_walls(changes: dict) -> None:
    """Refuse the changes that studies of the paper's Figure 5 make themselves; changes of gains are accepted."""
    refuse(changes, ("controller.estimator", "controller.output"), "it compares methods")
    refuse(changes, WALL, "it hits many walls")
