"""The command `gains`."""

from ..sim.scene.case import Case
from ..sim.studies import gains
from .maps import mapper_of
from .options import ModelOption, StartsOption
from .scenes import SceneArgument, refuse_for_maps
from .study import StudyOptions, study


@study("workers", "scheduler", "resume", "set_", "plot")
def command(
    options: StudyOptions, scene: SceneArgument = "seed-2011", starts: StartsOption = 3, backend: ModelOption = "fixed"
) -> None:
    changes = options.changes()
    refuse_for_maps(changes, "it searches them")
    options.finish(gains.study(Case.of(scene, changes), mapper_of(options, backend, starts)))
