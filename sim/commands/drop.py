"""The command `drop`."""

from ..jobs.store import Store
from ..scene.case import Case
from ..studies import drop
from ..walls.zwidth import STARTS
from .maps import Maps
from .options import WALL, ModelOption, SceneArgument, StartsOption, refuse
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
