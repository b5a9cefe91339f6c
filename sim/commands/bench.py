"""The command `bench`."""

from ..scene.case import Case
from ..studies import bench
from .options import SceneArgument
from .study import StudyOptions, study
from .terminal import log


@study()
def command(options: StudyOptions, scene: SceneArgument = "mhz") -> None:
    options.finish(bench.study(Case.of(scene), log.print))
